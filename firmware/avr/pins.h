/* The pins of the board that this is compiled for, by name: pin_high(PIN_STEP). */
#pragma once

#include <avr/io.h>
#include <util/atomic.h>

#if defined(__AVR_ATmega2560__)
#include "board_atmega2560.h"
#elif defined(__AVR_ATmega328P__)
#include "board_atmega328p.h"
#else
#error "write a board header for this chip"
#endif

#define PORT_OF(letter, bit) PORT##letter
#define DDR_OF(letter, bit) DDR##letter
#define PIN_OF(letter, bit) PIN##letter
#define MASK_OF(letter, bit) ((uint8_t)(1 << (bit)))

/* Ports beyond the reach of sbi take a read and a write, which nothing may come between. */
#define pin_high(pin) pin_write(pin, pin(PORT_OF) | pin(MASK_OF))
#define pin_low(pin) pin_write(pin, pin(PORT_OF) & ~pin(MASK_OF))
#define pin_write(pin, value)                       \
    do {                                            \
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE)           \
        {                                           \
            pin(PORT_OF) = (uint8_t)(value);        \
        }                                           \
    } while (0)
#define pin_is_high(pin) ((pin(PIN_OF) & pin(MASK_OF)) != 0)
