// SPDX-License-Identifier: GPL-3.0-or-later
/* The microcontroller: the real ELF under libsimavr, in virtual time. One per process. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define CYCLES_PER_US 16
#define BYTE_CYCLES (40 * CYCLES_PER_US) /* ten bits at 250,000 baud */

enum output { STEP, DIRECTION, ENABLE, LED_SUPPLY, STROBE, OUTPUT_COUNT };
enum input { ESTOP, INDEX, BUTTON, INPUT_COUNT };

/* What the chip tells the world around it, which the user of this file supplies. */
struct chip_listener {
    void (*output)(enum output output, bool high); /* when it changes, floating pins included */
    void (*spi)(uint8_t byte);
    void (*sent)(uint8_t byte);
    void (*was_reset)(void); /* before any output changes */
};

/* Prints the reason and exits if the ELF cannot be run. */
void chip_open(const char *elf, const struct chip_listener *listener);

void chip_power_up(uint32_t noise); /* memory holds noise, the EEPROM is blank */
void chip_watchdog_reset(void);     /* as the watchdog does it */

uint64_t chip_cycle(void); /* since the program began */
void chip_run_until(uint64_t cycle);

/* Until the firmware sleeps and nothing is on the wire, but not beyond `cycle`. */
void chip_run_until_quiet(uint64_t cycle);

void chip_drive(enum input input, bool high);
bool chip_receive(uint8_t byte); /* its last bit has arrived; false: the chip lost it */
uint8_t *chip_eeprom(void);

/* How deep the stack has been, in bytes: as far down as anything was overwritten since power-up. */
uint16_t chip_stack_used(void);
