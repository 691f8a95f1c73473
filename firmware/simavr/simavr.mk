# The rig around the real ELF, under libsimavr: build/turnlight-simavr-<board> ELF [TRACE [paced]].
# GPL-3.0-or-later, as libsimavr is. Past the arguments the program is the native one: its main()
# is called serve() here.
SIMAVR_SOURCES := $(wildcard simavr/*.c)
SIMAVR_SHARED := $(addprefix native/,main.c pty.c side_channel.c entropy.c world.c led_strip.c)
SIMAVR_HEADERS := $(wildcard simavr/*.h native/*.h core/*.h avr/board_*.h)

.PHONY: simavr
simavr: avr $(BOARDS:%=$(BUILD_DIR)/turnlight-simavr-%)

$(BUILD_DIR)/turnlight-simavr-%: $(SIMAVR_SOURCES) $(SIMAVR_HEADERS) $(BUILD_DIR)/serve.o
	@echo "   $@"
	@$(CC) $(CFLAGS) -Iavr -isystem /usr/include/simavr -DBOARD_HEADER='"board_$*.h"' \
	  $(SIMAVR_SOURCES) $(BUILD_DIR)/serve.o -lsimavr -lelf -lm -o $@

$(BUILD_DIR)/serve.o: $(SIMAVR_SHARED) $(SIMAVR_HEADERS) Makefile simavr/simavr.mk | $(BUILD_DIR)
	@$(CC) $(CFLAGS) -Dmain=serve -r -nostdlib $(SIMAVR_SHARED) -o $@
