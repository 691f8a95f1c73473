/* The firmware's serial port, as a pty that a host opens like any other port. */
#pragma once

#include <stddef.h>

/* Prints the reason and exits if there is none to be had. */
int pty_open(char *path, size_t limit);
void pty_write(int pty, const char *text, size_t length); /* drops what nobody reads */
