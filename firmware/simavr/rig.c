// SPDX-License-Identifier: GPL-3.0-or-later
/* The rig around the chip: native/rig.h, as the native build has it around the core alone. */
#include "rig.h"

#include "chip.h"
#include "hal.h"
#include "pace.h"
#include "rig_chip.h"
#include "trace.h"
#include "world.h"

#include <string.h>

#define BOOT_LIMIT_CYCLES (100000 * CYCLES_PER_US)
#define ANSWER_LIMIT_CYCLES (50000 * CYCLES_PER_US)

static struct {
    struct world world;
    uint64_t power_up_cycle;
    uint64_t now_cycle; /* the chip may be some cycles ahead: it finishes its instruction */
    bool spoken_to;
} rig;

static void on_output(enum output output, bool high);
static void on_spi(uint8_t byte);
static void on_sent(uint8_t byte);
static void on_reset(void);
static void boot(void);
static void run_for(uint64_t cycles);
static void run_until_quiet(uint64_t limit_cycles);
static void set_inputs(void);

static const struct chip_listener listener = {on_output, on_spi, on_sent, on_reset};

void rig_open(const char *elf)
{
    chip_open(elf, &listener);
}

void rig_power_up(uint32_t entropy)
{
    memset(&rig, 0, sizeof rig);
    world_begin(&rig.world);
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
        trace_flush();
        pace_until(rig.now_cycle / CYCLES_PER_US);
        rig.spoken_to = false;
    }
    return world_take_output(&rig.world, text, limit);
}

void rig_slip(int32_t centidegrees)
{
    world_turn(&rig.world, centidegrees * (int64_t)10000);
    set_inputs();
}

void rig_jam(bool jammed)
{
    rig.world.jammed = jammed;
}

void rig_press_estop(bool pressed)
{
    rig.world.state.estop = pressed;
    trace(rig.now_cycle, "estop", pressed);
    set_inputs();
}

void rig_press_button(bool pressed)
{
    rig.world.state.button = pressed;
    set_inputs();
}

void rig_hide_mark(bool hidden)
{
    rig.world.state.mark_hidden = hidden;
    set_inputs();
}

void rig_spoil_eeprom(uint8_t address)
{
    chip_eeprom()[address] = (uint8_t)~chip_eeprom()[address];
}

const struct rig_state *rig_state(void)
{
    rig.world.state.time_us = (rig.now_cycle - rig.power_up_cycle) / CYCLES_PER_US;
    trace(rig.now_cycle, "stack", chip_stack_used());
    return world_state(&rig.world);
}

static void on_output(enum output output, bool high)
{
    static const char *const names[] = {"step", "direction", "enable", "supply", "strobe"};
    trace(chip_cycle(), names[output], high);
    switch (output) {
    case STEP:
        if (high) {
            world_step(&rig.world);
            set_inputs();
        }
        break;
    case DIRECTION:
        rig.world.forward = high;
        break;
    case ENABLE:
        rig.world.motor_enabled = !high;
        break;
    case LED_SUPPLY:
        world_supply_leds(&rig.world, high);
        break;
    case STROBE:
        rig.world.state.strobes += high;
        break;
    case OUTPUT_COUNT:
        break;
    }
}

static void on_spi(uint8_t byte)
{
    world_clock_leds(&rig.world, byte);
}

static void on_sent(uint8_t byte)
{
    trace(chip_cycle(), "sent", byte);
    world_send(&rig.world, byte);
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
    chip_drive(ESTOP, rig.world.state.estop);
    chip_drive(INDEX, !world_on_mark(&rig.world));
    chip_drive(BUTTON, !rig.world.state.button);
}
