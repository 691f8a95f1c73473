#include "rig.h"

#include "core.h"
#include "hal.h"
#include "world.h"

#include <string.h>

#define TICK_US 1000
#define BYTE_US 40 /* ten bits at 250,000 baud */

static struct {
    struct world world;
    uint64_t boot_us;
    uint64_t tick_us;
    uint64_t step_us;
    bool stepping;
    bool strobe;
    uint8_t eeprom[HAL_EEPROM_SIZE];
    uint32_t entropy;
    const char *reset_cause;
    uint64_t wire_us; /* time that sent bytes have taken and the clock has not yet */
} rig;

static void boot(uint32_t entropy, const char *cause);
static void run_until(uint64_t end_us);

void rig_power_up(uint32_t entropy)
{
    memset(&rig, 0, sizeof rig);
    memset(rig.eeprom, 0xFF, sizeof rig.eeprom);
    world_begin(&rig.world);
    boot(entropy, "power");
}

void rig_watchdog_reset(uint32_t entropy)
{
    boot(entropy, "watchdog");
}

void rig_host_byte(uint8_t byte)
{
    run_until(rig.world.state.time_us + BYTE_US);
    core_receive(byte);
    core_poll();
    uint64_t answer_us = rig.wire_us;
    rig.wire_us = 0;
    run_until(rig.world.state.time_us + answer_us);
}

void rig_advance_us(uint64_t us)
{
    run_until(rig.world.state.time_us + us);
    rig.wire_us = 0;
}

size_t rig_take_output(char *text, size_t limit)
{
    return world_take_output(&rig.world, text, limit);
}

void rig_slip(int32_t centidegrees)
{
    world_turn(&rig.world, centidegrees * (int64_t)10000);
}

void rig_jam(bool jammed)
{
    rig.world.jammed = jammed;
}

void rig_press_estop(bool pressed)
{
    rig.world.state.estop = pressed;
}

void rig_press_button(bool pressed)
{
    rig.world.state.button = pressed;
}

void rig_hide_mark(bool hidden)
{
    rig.world.state.mark_hidden = hidden;
}

void rig_spoil_eeprom(uint8_t address)
{
    rig.eeprom[address] = (uint8_t)~rig.eeprom[address];
}

const struct rig_state *rig_state(void)
{
    return world_state(&rig.world);
}

uint32_t hal_time_us(void)
{
    return (uint32_t)(rig.world.state.time_us - rig.boot_us);
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
    world_send(&rig.world, byte);
}

void hal_step_timer_start(uint16_t interval_us)
{
    rig.stepping = true;
    rig.step_us = rig.world.state.time_us + interval_us;
}

void hal_step_timer_stop(void)
{
    rig.stepping = false;
}

void hal_step_pulse(void)
{
    world_step(&rig.world);
}

void hal_step_direction(bool positive)
{
    rig.world.forward = positive;
}

void hal_motor_enable(bool on)
{
    rig.world.motor_enabled = on;
}

bool hal_index(void)
{
    return world_on_mark(&rig.world);
}

void hal_spi_write(uint8_t byte)
{
    world_clock_leds(&rig.world, byte);
}

void hal_led_supply(bool on)
{
    world_supply_leds(&rig.world, on);
}

void hal_strobe(bool high)
{
    rig.world.state.strobes += high && !rig.strobe;
    rig.strobe = high;
}

bool hal_estop_pressed(void)
{
    return rig.world.state.estop;
}

bool hal_button_pressed(void)
{
    return rig.world.state.button;
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
    rig.boot_us = rig.world.state.time_us;
    rig.tick_us = rig.world.state.time_us + TICK_US;
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
        rig.world.state.time_us = next_us;
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
    rig.world.state.time_us = end_us;
}
