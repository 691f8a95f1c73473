/* Where things are connected: ATmega328P (Arduino Uno). The simulated chip reads this too.
 * WIRING.md shows it as a picture. */
#pragma once

#define BOARD "atmega328p"

/* port and bit;           Arduino pin */
#define PIN_ESTOP(X) X(D, 2)      /* D2, input with pull-up: high is pressed */
#define PIN_INDEX(X) X(D, 3)      /* D3, input with pull-up: low is the mark */
#define PIN_BUTTON(X) X(D, 4)     /* D4, input with pull-up: low is pressed */
#define PIN_STEP(X) X(D, 5)       /* D5 */
#define PIN_DIRECTION(X) X(D, 6)  /* D6, high: counter-clockwise seen from above */
#define PIN_ENABLE(X) X(D, 7)     /* D7, low: the motor is driven */
#define PIN_LED_SUPPLY(X) X(B, 0) /* D8, high: the LEDs have power */
#define PIN_STROBE(X) X(B, 1)     /* D9, high pulse */
#define PIN_SPI_SELECT(X) X(B, 2) /* D10, not connected: must be an output for SPI to work */
#define PIN_SPI_DATA(X) X(B, 3)   /* D11, to the LEDs' data input */
#define PIN_SPI_CLOCK(X) X(B, 5)  /* D13, to the LEDs' clock input */

#define UART_RECEIVE_VECTOR USART_RX_vect
