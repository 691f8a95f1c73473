/* Where things are connected: ATmega2560 (Arduino Mega), the reference board. The simulated chip
 * reads this too. WIRING.md shows it as a picture. */
#pragma once

#define BOARD "atmega2560"

/* port and bit;           Arduino pin */
#define PIN_ESTOP(X) X(E, 4)      /* D2, input with pull-up: high is pressed */
#define PIN_INDEX(X) X(E, 5)      /* D3, input with pull-up: low is the mark */
#define PIN_BUTTON(X) X(G, 5)     /* D4, input with pull-up: low is pressed */
#define PIN_STEP(X) X(E, 3)       /* D5 */
#define PIN_DIRECTION(X) X(H, 3)  /* D6, high: counter-clockwise seen from above */
#define PIN_ENABLE(X) X(H, 4)     /* D7, low: the motor is driven */
#define PIN_LED_SUPPLY(X) X(H, 5) /* D8, high: the LEDs have power */
#define PIN_STROBE(X) X(H, 6)     /* D9, high pulse */
#define PIN_SPI_SELECT(X) X(B, 0) /* D53, not connected: must be an output for SPI to work */
#define PIN_SPI_CLOCK(X) X(B, 1)  /* D52, to the LEDs' clock input */
#define PIN_SPI_DATA(X) X(B, 2)   /* D51, to the LEDs' data input */

#define UART_RECEIVE_VECTOR USART0_RX_vect
