// SPDX-License-Identifier: GPL-3.0-or-later
#include "chip.h"

#include BOARD_HEADER

#include <avr_eeprom.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <avr_spi.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_core.h>
#include <sim_elf.h>
#include <sim_io.h>

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MCUSR_ADDRESS 0x54
#define POWER_ON_FLAG 0x01
#define WATCHDOG_FLAG 0x08
#define BITS_PER_BYTE_SENT 10 /* start, eight, stop */
#define RECEIVE_BUFFER 3      /* two bytes and the shift register */

DEFINE_FIFO(uint16_t, uart_fifo);

struct pin {
    char port[2];
    uint8_t bit;
    bool floats_high; /* the resistor that holds it while the chip does not */
};

#define AS_PIN(letter, bit) #letter, bit
static const struct pin outputs[OUTPUT_COUNT] = {
    [STEP] = {PIN_STEP(AS_PIN), false},
    [DIRECTION] = {PIN_DIRECTION(AS_PIN), false},
    [ENABLE] = {PIN_ENABLE(AS_PIN), true},
    [LED_SUPPLY] = {PIN_LED_SUPPLY(AS_PIN), false},
    [STROBE] = {PIN_STROBE(AS_PIN), false},
};
static const struct pin inputs[INPUT_COUNT] = {
    [ESTOP] = {PIN_ESTOP(AS_PIN), true},
    [INDEX] = {PIN_INDEX(AS_PIN), true},
    [BUTTON] = {PIN_BUTTON(AS_PIN), true},
};

static struct {
    avr_t *avr;
    const struct chip_listener *listener;
    avr_uart_t *uart;
    avr_spi_t *spi;
    avr_eeprom_t *eeprom;
    avr_io_t reset_hook;
    bool was_reset;
    uint16_t stack_limit; /* static data ends here */
    uint8_t *noise;        /* what memory held at power-up */
    bool high[OUTPUT_COUNT];
    bool driven[INPUT_COUNT];
    uint8_t to_send;     /* in the UART's buffer */
    uint64_t wire_free;  /* when all before it has been sent */
    uint64_t deadline;
    bool deadline_armed;
    bool until_quiet;
    bool quiet;
} chip;

static uint16_t address_of(const elf_firmware_t *firmware, const char *symbol);
static void *find(const char *kind, char name);
static void listen(void);
static void correct_simavr(void);
static void on_reset(avr_io_t *hook);
static void recover_from_reset(void);
static void run(void);
static void sleep_in_virtual_time(avr_t *avr, avr_cycle_count_t cycles);
static avr_cycle_count_t wake(avr_t *avr, avr_cycle_count_t when, void *unused);
static void on_level(avr_irq_t *irq, uint32_t value, void *port);
static void on_direction(avr_irq_t *irq, uint32_t value, void *port);
static void update_outputs(const avr_ioport_t *port, uint8_t direction);
static void apply_input(enum input input);
static void write_uart(avr_t *avr, avr_io_addr_t address, uint8_t byte, void *unused);
static avr_cycle_count_t begin_byte(avr_t *avr, avr_cycle_count_t when, void *unused);
static void write_spi(avr_t *avr, avr_io_addr_t address, uint8_t byte, void *unused);
static avr_cycle_count_t finish_spi(avr_t *avr, avr_cycle_count_t when, void *unused);
static void correct_byte_time(void);
static void log_errors(avr_t *avr, const int level, const char *format, va_list values);
static void fail(const char *what);

void chip_open(const char *elf, const struct chip_listener *listener)
{
    avr_global_logger_set(log_errors);
    elf_firmware_t firmware = {0};
    if (elf_read_firmware(elf, &firmware) != 0)
        fail("the ELF cannot be read; run `make firmware`");
    chip.avr = avr_make_mcu_by_name(BOARD);
    if (chip.avr == NULL)
        fail("this libsimavr does not know the chip " BOARD);
    chip.listener = listener;
    avr_init(chip.avr);
    firmware.frequency = CYCLES_PER_US * 1000000;
    strcpy(firmware.mmcu, BOARD);
    avr_load_firmware(chip.avr, &firmware);
    chip.stack_limit = address_of(&firmware, "_end");
    chip.noise = malloc(chip.avr->ramend + 1u);
    chip.uart = find("uart", '0');
    chip.spi = find("spi", 0);
    chip.eeprom = find("eeprom", 0);
    listen();
    correct_simavr();
}

void chip_power_up(uint32_t noise)
{
    for (uint16_t i = 0; i <= chip.avr->ramend; i++) {
        noise = noise * 1664525 + 1013904223;
        chip.noise[i] = (uint8_t)(noise >> 24);
    }
    uint16_t memory = chip.avr->ioend + 1;
    memcpy(chip.avr->data + memory, chip.noise + memory, chip.avr->ramend + 1u - memory);
    memset(chip.eeprom->eeprom, 0xFF, chip.eeprom->size);
    avr_reset(chip.avr);
    recover_from_reset();
    chip.avr->data[MCUSR_ADDRESS] = POWER_ON_FLAG;
}

void chip_watchdog_reset(void)
{
    avr_reset(chip.avr);
    recover_from_reset();
    chip.avr->data[MCUSR_ADDRESS] = WATCHDOG_FLAG;
}

uint64_t chip_cycle(void)
{
    return chip.avr->cycle;
}

void chip_run_until(uint64_t cycle)
{
    chip.until_quiet = false;
    chip.deadline = cycle;
    run();
}

void chip_run_until_quiet(uint64_t cycle)
{
    chip.until_quiet = true;
    chip.deadline = cycle;
    run();
}

void chip_drive(enum input input, bool high)
{
    chip.driven[input] = high;
    apply_input(input);
}

bool chip_receive(uint8_t byte)
{
    correct_byte_time();
    uint16_t waiting = (uint16_t)(chip.uart->input.write - chip.uart->input.read);
    if (waiting % uart_fifo_fifo_size >= RECEIVE_BUFFER
        || chip.uart->cycles_per_byte != BYTE_CYCLES)
        return false;
    chip.uart->cycles_per_byte = 1;
    avr_raise_irq(chip.uart->io.irq + UART_IRQ_INPUT, byte);
    correct_byte_time();
    return true;
}

uint8_t *chip_eeprom(void)
{
    return chip.eeprom->eeprom;
}

uint16_t chip_stack_used(void)
{
    uint16_t lowest = chip.stack_limit;
    while (lowest < chip.avr->ramend && chip.avr->data[lowest] == chip.noise[lowest])
        lowest++;
    return (uint16_t)(chip.avr->ramend + 1 - lowest);
}

static uint16_t address_of(const elf_firmware_t *firmware, const char *symbol)
{
    for (uint32_t i = 0; i < firmware->symbolcount; i++)
        if (strcmp(firmware->symbol[i]->symbol, symbol) == 0)
            return (uint16_t)firmware->symbol[i]->addr;
    fail("the ELF has no symbols");
    return 0;
}

/* name 0: there is only one of the kind. */
static void *find(const char *kind, char name)
{
    for (avr_io_t *io = chip.avr->io_port; io != NULL; io = io->next)
        if (strcmp(io->kind, kind) == 0 && (name == 0 || ((avr_ioport_t *)io)->name == name))
            return io;
    fail(kind);
    return NULL;
}

static void listen(void)
{
    for (int i = 0; i < OUTPUT_COUNT; i++) {
        avr_ioport_t *port = find("port", outputs[i].port[0]);
        avr_irq_t *level = port->io.irq + IOPORT_IRQ_REG_PORT;
        avr_irq_t *direction = port->io.irq + IOPORT_IRQ_DIRECTION_ALL;
        avr_irq_register_notify(level, on_level, port);
        avr_irq_register_notify(direction, on_direction, port);
        level->flags &= (uint8_t)~IRQ_FLAG_FILTERED;
        direction->flags &= (uint8_t)~IRQ_FLAG_FILTERED;
    }
    chip.reset_hook = (avr_io_t){.kind = "world", .reset = on_reset};
    avr_register_io(chip.avr, &chip.reset_hook);
}

/* Where simavr 1.6 and the chip differ: it sleeps by the wall's clock; its UART sleeps when it is
 * polled, counts a parity bit that is not there and has no buffer beside the byte that it sends; an
 * SPI byte takes 100 us. A low pin of an external interrupt is polled every cycle; see recover_from_reset(). */
static void correct_simavr(void)
{
    chip.avr->sleep = sleep_in_virtual_time;
    chip.uart->flags = 0;
    chip.avr->io[AVR_DATA_TO_IO(chip.uart->r_udr)].w.c = write_uart;
    chip.avr->io[AVR_DATA_TO_IO(chip.spi->r_spdr)].w.c = write_spi;
}

static void on_reset(avr_io_t *hook)
{
    (void)hook;
    chip.was_reset = true;
}

/* By now simavr has dropped all timers, floated all pins, and asked for the polling of external
 * interrupts again. */
static void recover_from_reset(void)
{
    chip.was_reset = false;
    chip.wire_free = 0;
    chip.deadline_armed = false;
    for (uint8_t i = 0; i < EXTINT_COUNT; i++)
        avr_extint_set_strict_lvl_trig(chip.avr, i, 0);
    chip.listener->was_reset();
    for (int i = 0; i < OUTPUT_COUNT; i++)
        update_outputs(find("port", outputs[i].port[0]), 0);
    for (int i = 0; i < INPUT_COUNT; i++)
        apply_input((enum input)i);
}

static void run(void)
{
    chip.deadline_armed = false;
    chip.quiet = false;
    while (chip.avr->cycle < chip.deadline && !chip.quiet) {
        if (!chip.deadline_armed) {
            avr_cycle_timer_register(chip.avr, chip.deadline - chip.avr->cycle, wake, NULL);
            chip.deadline_armed = true;
            chip.avr->run_cycle_count = 0; /* simavr had been free to run on to the next timer */
        }
        int state = avr_run(chip.avr);
        if (chip.was_reset)
            recover_from_reset();
        if (state == cpu_Done || state == cpu_Crashed)
            fail("the firmware has crashed");
    }
    avr_cycle_timer_cancel(chip.avr, wake, NULL);
}

/* simavr adds the cycles itself. A run that is over does not sleep on. */
static void sleep_in_virtual_time(avr_t *avr, avr_cycle_count_t cycles)
{
    bool wire_idle = avr->cycle >= chip.wire_free && uart_fifo_isempty(&chip.uart->input);
    chip.quiet = chip.until_quiet && wire_idle;
    if (chip.quiet || avr->cycle >= chip.deadline)
        avr->cycle -= cycles;
}

/* Sleep ends here. */
static avr_cycle_count_t wake(avr_t *avr, avr_cycle_count_t when, void *unused)
{
    (void)avr, (void)when, (void)unused;
    return 0;
}

static void on_level(avr_irq_t *irq, uint32_t value, void *port)
{
    (void)irq, (void)value;
    update_outputs(port, chip.avr->data[((avr_ioport_t *)port)->r_ddr]);
}

/* Told before the register changes. */
static void on_direction(avr_irq_t *irq, uint32_t value, void *port)
{
    (void)irq;
    update_outputs(port, (uint8_t)value);
}

static void update_outputs(const avr_ioport_t *port, uint8_t direction)
{
    uint8_t level = chip.avr->data[port->r_port];
    for (int i = 0; i < OUTPUT_COUNT; i++) {
        if (outputs[i].port[0] != port->name)
            continue;
        bool is_driven = (direction >> outputs[i].bit) & 1;
        bool high = is_driven ? (level >> outputs[i].bit) & 1 : outputs[i].floats_high;
        if (high == chip.high[i])
            continue;
        chip.high[i] = high;
        chip.listener->output((enum output)i, high);
    }
}

/* A port write that sets a pull-up would overwrite the input: it must be told as "external" too. */
static void apply_input(enum input input)
{
    avr_ioport_t *port = find("port", inputs[input].port[0]);
    avr_irq_t *pin = port->io.irq + inputs[input].bit;
    uint8_t mask = (uint8_t)(1 << inputs[input].bit);
    port->external.pull_mask |= mask;
    port->external.pull_value &= (uint8_t)~mask;
    if (chip.driven[input])
        port->external.pull_value |= mask;
    pin->flags &= (uint8_t)~IRQ_FLAG_FILTERED;
    avr_raise_irq(pin, chip.driven[input]);
}

static void write_uart(avr_t *avr, avr_io_addr_t address, uint8_t byte, void *unused)
{
    (void)address, (void)unused;
    correct_byte_time();
    avr_regbit_clear(avr, chip.uart->udrc.raised);
    uint64_t wait = chip.wire_free > avr->cycle ? chip.wire_free - avr->cycle : 1;
    chip.to_send = byte;
    chip.wire_free = avr->cycle + wait + chip.uart->cycles_per_byte;
    avr_cycle_timer_register(avr, wait, begin_byte, NULL);
    avr_cycle_timer_register(avr, chip.wire_free - avr->cycle, wake, &chip.wire_free);
}

/* From the buffer onto the wire: the buffer is free for the next. */
static avr_cycle_count_t begin_byte(avr_t *avr, avr_cycle_count_t when, void *unused)
{
    (void)when, (void)unused;
    avr_regbit_set(avr, chip.uart->udrc.raised);
    chip.listener->sent(chip.to_send);
    return 0;
}

static void write_spi(avr_t *avr, avr_io_addr_t address, uint8_t byte, void *unused)
{
    (void)address, (void)unused;
    static const uint8_t divider[] = {4, 16, 64, 128, 2, 8, 32, 64};
    uint8_t control = avr->data[chip.spi->r_spcr], status = avr->data[chip.spi->r_spsr];
    if (!avr_regbit_get(avr, chip.spi->spe))
        return;
    avr_regbit_clear(avr, chip.spi->spi.raised);
    avr_cycle_timer_register(avr, 8u * divider[(control & 3) | (status & 1) << 2], finish_spi, NULL);
    chip.listener->spi(byte);
}

static avr_cycle_count_t finish_spi(avr_t *avr, avr_cycle_count_t when, void *unused)
{
    (void)when, (void)unused;
    avr_regbit_set(avr, chip.spi->spi.raised);
    return 0;
}

static void correct_byte_time(void)
{
    avr_t *avr = chip.avr;
    uint32_t divider = avr->data[chip.uart->ubrrl.reg] + 256u * (avr->data[chip.uart->ubrrh.reg] & 0xF);
    uint32_t per_bit = (divider + 1) * (avr_regbit_get(avr, chip.uart->u2x) ? 8 : 16);
    chip.uart->cycles_per_byte = BITS_PER_BYTE_SENT * per_bit;
}

/* Standard output is the side channel's. */
static void log_errors(avr_t *avr, const int level, const char *format, va_list values)
{
    (void)avr;
    if (level <= LOG_ERROR)
        vfprintf(stderr, format, values);
}

static void fail(const char *what)
{
    fprintf(stderr, "turnlight-simavr: %s\n", what);
    exit(1);
}
