/* The seam: everything the core asks of a microcontroller, or of the PC that plays one.
 *
 * The port calls back into core.h. On a microcontroller core_tick(), core_step() and
 * core_receive() run in interrupts and core_poll() in the main loop. */
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
void hal_strobe(void); /* one pulse, long enough for a camera's input */

bool hal_estop_pressed(void);
bool hal_button_pressed(void);

void hal_watchdog_feed(void);
uint32_t hal_entropy(void); /* differs from boot to boot */
const char *hal_reset_cause(void);
const char *hal_board(void);
