// SPDX-License-Identifier: GPL-3.0-or-later
/* The rig around the chip: native/rig.h, as the native build has it around the core alone. */
#include "rig.h"

#include "chip.h"
#include "hal.h"
#include "led_strip.h"
#include "pace.h"
#include "rig_chip.h"
#include "trace.h"

#include <string.h>

#define TURN_UDEG 360000000
#define STEP_UDEG (TURN_UDEG / RIG_STEPS_PER_TURN)
#define MARK_UDEG 4000000 /* the mark is in the sensor from 0 to here */
#define START_UDEG 216000000
#define BOOT_LIMIT_CYCLES (100000 * CYCLES_PER_US)
#define ANSWER_LIMIT_CYCLES (50000 * CYCLES_PER_US)

static struct {
    struct rig_state state;
    uint64_t power_up_cycle;
    uint64_t now_cycle; /* the chip may be some cycles ahead: it finishes its instruction */
    bool forward;
    bool motor_enabled;
    bool led_supply;
    struct led_strip strip;
    bool jammed;
    bool spoken_to;
    char output[4096];
    size_t output_length;
} rig;

static void on_output(enum output output, bool high);
static void on_spi(uint8_t byte);
static void on_sent(uint8_t byte);
static void on_reset(void);
static void boot(void);
static void run_for(uint64_t cycles);
static void run_until_quiet(uint64_t limit_cycles);
static void set_inputs(void);
static void turn_table(int64_t udeg);

static const struct chip_listener listener = {on_output, on_spi, on_sent, on_reset};

void rig_open(const char *elf)
{
    chip_open(elf, &listener);
}

void rig_power_up(uint32_t entropy)
{
    memset(&rig, 0, sizeof rig);
    rig.state.angle_udeg = START_UDEG;
    set_inputs();
    chip_power_up(entropy);
    rig.power_up_cycle = chip_cycle();
    boot();
}

/* The chip's own noise, not `entropy`, makes the boot id: memory survives. */
void rig_watchdog_reset(uint32_t entropy)
{
    (void)entropy;
    chip_watchdog_reset();
    boot();
}

void rig_host_byte(uint8_t byte)
{
    if (!rig.spoken_to)
        pace_from(rig.now_cycle / CYCLES_PER_US);
    rig.spoken_to = true;
    run_for(BYTE_CYCLES);
    trace(rig.now_cycle, chip_receive(byte) ? "received" : "lost", byte);
}

void rig_advance_us(uint64_t us)
{
    run_for(us * CYCLES_PER_US);
}

/* The firmware finishes its answer first. */
size_t rig_take_output(char *text, size_t limit)
{
    if (rig.spoken_to) {
        run_until_quiet(ANSWER_LIMIT_CYCLES);
        pace_until(rig.now_cycle / CYCLES_PER_US);
        rig.spoken_to = false;
    }
    size_t length = rig.output_length < limit ? rig.output_length : limit;
    memcpy(text, rig.output, length);
    rig.output_length -= length;
    memmove(rig.output, rig.output + length, rig.output_length);
    trace_flush();
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
    trace(rig.now_cycle, "estop", pressed);
    set_inputs();
}

void rig_press_button(bool pressed)
{
    rig.state.button = pressed;
    set_inputs();
}

void rig_hide_mark(bool hidden)
{
    rig.state.mark_hidden = hidden;
    set_inputs();
}

void rig_spoil_eeprom(uint8_t address)
{
    chip_eeprom()[address] = (uint8_t)~chip_eeprom()[address];
}

const struct rig_state *rig_state(void)
{
    rig.state.time_us = (rig.now_cycle - rig.power_up_cycle) / CYCLES_PER_US;
    for (uint8_t led = 0; led < LED_COUNT; led++)
        rig.state.levels[led] = rig.led_supply ? rig.strip.levels[led] : 0;
    trace(rig.now_cycle, "stack", chip_stack_used());
    return &rig.state;
}

/* The emergency stop cuts the motor's driver in hardware. */
static void on_output(enum output output, bool high)
{
    static const char *const names[] = {"step", "direction", "enable", "supply", "strobe"};
    trace(chip_cycle(), names[output], high);
    switch (output) {
    case STEP:
        rig.state.steps += high;
        if (high && rig.motor_enabled && !rig.state.estop && !rig.jammed)
            turn_table(rig.forward ? STEP_UDEG : -STEP_UDEG);
        break;
    case DIRECTION:
        rig.forward = high;
        break;
    case ENABLE:
        rig.motor_enabled = !high;
        break;
    case LED_SUPPLY:
        rig.led_supply = high;
        if (!high)
            memset(&rig.strip, 0, sizeof rig.strip);
        break;
    case STROBE:
        rig.state.strobes += high;
        break;
    case OUTPUT_COUNT:
        break;
    }
}

static void on_spi(uint8_t byte)
{
    if (rig.led_supply)
        led_strip_clock(&rig.strip, byte);
}

static void on_sent(uint8_t byte)
{
    trace(chip_cycle(), "sent", byte);
    if (rig.output_length < sizeof rig.output)
        rig.output[rig.output_length++] = (char)byte;
}

static void on_reset(void)
{
    trace(chip_cycle(), "reset", 0);
}

static void boot(void)
{
    rig.now_cycle = chip_cycle();
    run_until_quiet(BOOT_LIMIT_CYCLES);
}

static void run_for(uint64_t cycles)
{
    rig.now_cycle += cycles;
    chip_run_until(rig.now_cycle);
}

static void run_until_quiet(uint64_t limit_cycles)
{
    chip_run_until_quiet(rig.now_cycle + limit_cycles);
    if (chip_cycle() > rig.now_cycle)
        rig.now_cycle = chip_cycle();
}

static void set_inputs(void)
{
    bool on_mark = !rig.state.mark_hidden && rig.state.angle_udeg < MARK_UDEG;
    chip_drive(ESTOP, rig.state.estop);
    chip_drive(INDEX, !on_mark);
    chip_drive(BUTTON, !rig.state.button);
}

static void turn_table(int64_t udeg)
{
    int64_t angle = ((int64_t)rig.state.angle_udeg + udeg) % TURN_UDEG;
    rig.state.angle_udeg = (uint32_t)(angle < 0 ? angle + TURN_UDEG : angle);
    set_inputs();
}
