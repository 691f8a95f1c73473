/* FLASH marks a constant table that a microcontroller keeps out of its RAM. Read one through a
 * pointer that says so too. AVR ports compile the core as gnu11, which knows __flash. */
#pragma once

#ifdef __AVR__
#define FLASH __flash
#else
#define FLASH
#endif
