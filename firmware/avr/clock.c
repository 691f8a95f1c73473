#include "clock.h"

#include "core.h"
#include "hal.h"
#include "idle.h"
#include "pins.h"

#include <avr/interrupt.h>

#define COUNTS_PER_US 2
#define TICK_COUNTS 250 /* of timer 0, at 4 us each */
#define SOONEST 8       /* counts from now that a compare match can still be set to */
#define FARTHEST_US 30000

static volatile struct {
    uint8_t changes;
    uint32_t us;
    uint16_t count; /* timer 1's when it was `us` */
} time;

static uint16_t later_us; /* what is left of an interval that is longer than the timer reaches */

static void tick(void);
static void catch_up(void);
static uint16_t timer_count(void);
static uint16_t first_part(uint16_t interval_us);

void clock_init(void)
{
    TCCR1A = 0;
    TCCR1B = _BV(CS11); /* 16 MHz / 8 */
    TCCR0A = _BV(WGM01);
    TCCR0B = _BV(CS01) | _BV(CS00); /* 16 MHz / 64 */
    OCR0A = TICK_COUNTS - 1;
    TIMSK0 = _BV(OCIE0A);
}

/* Asked all the time: a critical section for all of it would make steps wait. */
uint32_t hal_time_us(void)
{
    uint8_t changes;
    uint32_t us;
    uint16_t passed;
    do {
        changes = time.changes;
        us = time.us;
        passed = (uint16_t)(timer_count() - time.count);
    } while (changes != time.changes);
    return us + passed / COUNTS_PER_US;
}

/* The tick itself may take long: everything else goes on meanwhile, only no second tick. */
ISR(TIMER0_COMPA_vect, ISR_NOBLOCK)
{
    TIMSK0 = 0;
    tick();
    cli();
    TIMSK0 = _BV(OCIE0A);
}

void hal_step_timer_start(uint16_t interval_us)
{
    OCR1A = (uint16_t)(TCNT1 + COUNTS_PER_US * first_part(interval_us));
    TIFR1 = _BV(OCF1A);
    TIMSK1 = _BV(OCIE1A);
}

void hal_step_timer_stop(void)
{
    TIMSK1 = 0;
}

void hal_step_pulse(void)
{
    pin_high(PIN_STEP);
}

/* The pulse ends with the interrupt: some 6 us, which is long enough for any driver. */
ISR(TIMER1_COMPA_vect)
{
    uint16_t interval_us = later_us > 0 ? later_us : core_step();
    if (interval_us == 0)
        TIMSK1 = 0;
    uint16_t next = (uint16_t)(OCR1A + COUNTS_PER_US * first_part(interval_us));
    uint16_t soonest = (uint16_t)(TCNT1 + SOONEST);
    if ((int16_t)(next - soonest) < 0)
        next = soonest; /* a match that has gone by would come again only in 33 ms */
    OCR1A = next;
    pin_low(PIN_STEP);
}

static uint16_t first_part(uint16_t interval_us)
{
    later_us = interval_us > FARTHEST_US ? (uint16_t)(interval_us - FARTHEST_US) : 0;
    return (uint16_t)(interval_us - later_us);
}

/* A call keeps the interrupt from saving and restoring, all the while blocking, more than it must. */
static __attribute__((noinline)) void tick(void)
{
    catch_up();
    core_tick();
    idle_end();
}

/* Within 33 ms of the last time: the tick sees to it. */
static void catch_up(void)
{
    uint16_t passed_us = (uint16_t)(timer_count() - time.count) / COUNTS_PER_US;
    time.count = (uint16_t)(time.count + passed_us * COUNTS_PER_US);
    time.us += passed_us;
    time.changes++;
}

/* Both halves of a timer's register pass through a byte that the step interrupt uses too. */
static uint16_t timer_count(void)
{
    bool interrupts = hal_interrupts_off();
    uint16_t count = TCNT1;
    hal_interrupts_restore(interrupts);
    return count;
}
