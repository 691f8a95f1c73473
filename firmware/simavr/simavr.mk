# The rig around the real ELF, under libsimavr: build/turnlight-simavr-<board> ELF [TRACE [paced]].
# GPL-3.0-or-later, as libsimavr is. The program around it is the native build's.
SIMAVR_SOURCES := $(wildcard simavr/*.c) \
  $(addprefix native/,main.c pty.c side_channel.c entropy.c led_strip.c)
SIMAVR_HEADERS := $(wildcard simavr/*.h native/*.h core/*.h avr/board_*.h)

.PHONY: simavr
simavr: avr $(BOARDS:%=$(BUILD_DIR)/turnlight-simavr-%)

$(BUILD_DIR)/turnlight-simavr-%: $(SIMAVR_SOURCES) $(SIMAVR_HEADERS) Makefile simavr/simavr.mk | $(BUILD_DIR)
	@echo "   $@"
	@$(CC) $(CFLAGS) -Iavr -isystem /usr/include/simavr -DBOARD_HEADER='"board_$*.h"' \
	  $(SIMAVR_SOURCES) -lsimavr -lelf -lm -o $@
