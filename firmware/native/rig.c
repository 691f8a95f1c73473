#include "rig.h"

#include "core.h"
#include "led_strip.h"

#include "hal.h"

#include <string.h>

#define TURN_UDEG 360000000
#define STEP_UDEG (TURN_UDEG / RIG_STEPS_PER_TURN)
#define MARK_UDEG 4000000 /* the mark is in the sensor from 0 to here */
#define START_UDEG 216000000
#define TICK_US 1000
#define BYTE_US 40 /* ten bits at 250,000 baud */

static struct {
    struct rig_state state;
    uint64_t boot_us;
    uint64_t tick_us;
    uint64_t step_us;
    bool stepping;
    bool forward;
    bool motor_enabled;
    bool led_supply;
    struct led_strip strip;
    bool jammed;
    bool strobe;
    uint8_t eeprom[HAL_EEPROM_SIZE];
    uint32_t entropy;
    const char *reset_cause;
    char output[4096];
    size_t output_length;
    uint64_t wire_us; /* time that sent bytes have taken and the clock has not yet */
} rig;

static void boot(uint32_t entropy, const char *cause);
static void run_until(uint64_t end_us);
static void turn_table(int64_t udeg);

void rig_power_up(uint32_t entropy)
{
    memset(&rig, 0, sizeof rig);
    memset(rig.eeprom, 0xFF, sizeof rig.eeprom);
    rig.state.angle_udeg = START_UDEG;
    boot(entropy, "power");
}

void rig_watchdog_reset(uint32_t entropy)
{
    boot(entropy, "watchdog");
}

void rig_host_byte(uint8_t byte)
{
    run_until(rig.state.time_us + BYTE_US);
    core_receive(byte);
    core_poll();
    uint64_t answer_us = rig.wire_us;
    rig.wire_us = 0;
    run_until(rig.state.time_us + answer_us);
}

void rig_advance_us(uint64_t us)
{
    run_until(rig.state.time_us + us);
    rig.wire_us = 0;
}

size_t rig_take_output(char *text, size_t limit)
{
    size_t length = rig.output_length < limit ? rig.output_length : limit;
    memcpy(text, rig.output, length);
    rig.output_length -= length;
    memmove(rig.output, rig.output + length, rig.output_length);
    return length;
}

void rig_slip(int32_t centidegrees)
{
    turn_table(centidegrees * (int64_t)10000);
}

void rig_jam(bool jammed)
{
    rig.jammed = jammed;
}

void rig_press_estop(bool pressed)
{
    rig.state.estop = pressed;
}

void rig_press_button(bool pressed)
{
    rig.state.button = pressed;
}

void rig_hide_mark(bool hidden)
{
    rig.state.mark_hidden = hidden;
}

void rig_spoil_eeprom(uint8_t address)
{
    rig.eeprom[address] = (uint8_t)~rig.eeprom[address];
}

const struct rig_state *rig_state(void)
{
    for (uint8_t led = 0; led < LED_COUNT; led++)
        rig.state.levels[led] = rig.led_supply ? rig.strip.levels[led] : 0;
    return &rig.state;
}

uint32_t hal_time_us(void)
{
    return (uint32_t)(rig.state.time_us - rig.boot_us);
}

bool hal_interrupts_off(void)
{
    return true;
}

void hal_interrupts_restore(bool were_on)
{
    (void)were_on;
}

void hal_uart_write(uint8_t byte)
{
    rig.wire_us += BYTE_US;
    if (rig.output_length < sizeof rig.output)
        rig.output[rig.output_length++] = (char)byte;
}

void hal_step_timer_start(uint16_t interval_us)
{
    rig.stepping = true;
    rig.step_us = rig.state.time_us + interval_us;
}

void hal_step_timer_stop(void)
{
    rig.stepping = false;
}

/* The emergency stop cuts the motor's driver in hardware. */
void hal_step_pulse(void)
{
    rig.state.steps++;
    if (rig.motor_enabled && !rig.state.estop && !rig.jammed)
        turn_table(rig.forward ? STEP_UDEG : -STEP_UDEG);
}

void hal_step_direction(bool positive)
{
    rig.forward = positive;
}

void hal_motor_enable(bool on)
{
    rig.motor_enabled = on;
}

bool hal_index(void)
{
    return !rig.state.mark_hidden && rig.state.angle_udeg < MARK_UDEG;
}

void hal_spi_write(uint8_t byte)
{
    if (rig.led_supply)
        led_strip_clock(&rig.strip, byte);
}

void hal_led_supply(bool on)
{
    if (!on)
        memset(&rig.strip, 0, sizeof rig.strip);
    rig.led_supply = on;
}

void hal_strobe(bool high)
{
    rig.state.strobes += high && !rig.strobe;
    rig.strobe = high;
}

bool hal_estop_pressed(void)
{
    return rig.state.estop;
}

bool hal_button_pressed(void)
{
    return rig.state.button;
}

uint8_t hal_eeprom_read(uint8_t address)
{
    return rig.eeprom[address];
}

void hal_eeprom_write(uint8_t address, uint8_t value)
{
    rig.eeprom[address] = value;
}

void hal_watchdog_feed(void)
{
}

uint32_t hal_entropy(void)
{
    return rig.entropy;
}

const char *hal_reset_cause(void)
{
    return rig.reset_cause;
}

const char *hal_board(void)
{
    return "native";
}

static void boot(uint32_t entropy, const char *cause)
{
    rig.entropy = entropy;
    rig.reset_cause = cause;
    rig.boot_us = rig.state.time_us;
    rig.tick_us = rig.state.time_us + TICK_US;
    rig.stepping = false;
    core_init();
}

static void run_until(uint64_t end_us)
{
    for (;;) {
        bool step_first = rig.stepping && rig.step_us <= rig.tick_us;
        uint64_t next_us = step_first ? rig.step_us : rig.tick_us;
        if (next_us > end_us)
            break;
        rig.state.time_us = next_us;
        if (step_first) {
            uint16_t interval_us = core_step();
            rig.stepping = interval_us > 0;
            rig.step_us += interval_us;
        } else {
            core_tick();
            core_poll();
            rig.tick_us += TICK_US;
        }
    }
    rig.state.time_us = end_us;
}

static void turn_table(int64_t udeg)
{
    int64_t angle = ((int64_t)rig.state.angle_udeg + udeg) % TURN_UDEG;
    rig.state.angle_udeg = (uint32_t)(angle < 0 ? angle + TURN_UDEG : angle);
}
