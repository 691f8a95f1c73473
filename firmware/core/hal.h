/* The seam: everything the core asks of a microcontroller, or of the PC that plays one.
 *
 * The port calls back into core.h. On a microcontroller core_tick(), core_step() and
 * core_receive() run in interrupts and core_poll() in the main loop; core_tick() lets the other
 * two interrupt it. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

uint32_t hal_time_us(void); /* since boot; wraps after 71 minutes */

/* Nestable: keep what `off` returned and hand it to `restore`. */
bool hal_interrupts_off(void);
void hal_interrupts_restore(bool were_on);

void hal_uart_write(uint8_t byte); /* waits for room */

/* After interval_us, core_step() is called; what it returns is the next interval, 0 the end. */
void hal_step_timer_start(uint16_t interval_us);
void hal_step_timer_stop(void);
void hal_step_pulse(void);
void hal_step_direction(bool positive); /* positive: counter-clockwise seen from above */
void hal_motor_enable(bool on);
bool hal_index(void); /* the table's mark is in the sensor */

void hal_spi_write(uint8_t byte);
void hal_led_supply(bool on);
void hal_strobe(bool high);

bool hal_estop_pressed(void); /* asked before every step: no more than a look at the pin */
bool hal_button_pressed(void);

#define HAL_EEPROM_SIZE 128 /* bytes that the core may use; those above are the port's */
uint8_t hal_eeprom_read(uint8_t address);
void hal_eeprom_write(uint8_t address, uint8_t value); /* waits until it is kept: some ms */

void hal_watchdog_feed(void);           /* for another 250 ms */
uint32_t hal_entropy(void);            /* differs from boot to boot */
const char *hal_reset_cause(void);     /* a word: power, watchdog, brownout, external, unknown */
const char *hal_board(void);           /* a word */
