# The AVR binaries: build/turnlight-{atmega2560,atmega328p}.{elf,hex}, and a .json beside each that
# says what `hello` must answer. The limits are the ATmega328P's: half its flash, half its RAM for
# static data and half for the stack.
BOARDS := atmega2560 atmega328p
FLASH_LIMIT := 16384
RAM_LIMIT := 1024
STACK_LIMIT := 1024

# Not -O2: avr-gcc 5.4 then reads a table in flash from RAM where a loop copies it.
AVR_CFLAGS := -std=gnu11 -Os -g -flto -fshort-enums -DF_CPU=16000000UL $(WARNINGS) \
  -DBUILD='"$(BUILD)"' -Icore -Iavr
AVR_SOURCES := $(CORE) $(wildcard avr/*.c)
AVR_HEADERS := $(wildcard core/*.h avr/*.h)
AVR_DEPENDENCIES := $(AVR_SOURCES) $(AVR_HEADERS) Makefile avr/avr.mk avr/footprint.py
VERSION := $(shell sed -n 's/.*FIRMWARE_VERSION "\(.*\)"/\1/p' core/config.h)

.PHONY: avr
.SECONDARY:
.DELETE_ON_ERROR:
avr: $(BOARDS:%=$(BUILD_DIR)/turnlight-%.hex) $(BOARDS:%=$(BUILD_DIR)/turnlight-%-hang.elf)
	@for board in $(BOARDS); do python3 avr/footprint.py $(BUILD_DIR)/turnlight-$$board.elf \
	  $(FLASH_LIMIT) $(RAM_LIMIT) $(STACK_LIMIT) || exit 1; done

$(BUILD_DIR)/turnlight-%.hex: $(BUILD_DIR)/turnlight-%.elf
	@avr-objcopy -O ihex -R .eeprom $< $@

$(BUILD_DIR)/turnlight-%.elf: $(AVR_DEPENDENCIES) | $(BUILD_DIR)
	@avr-gcc -mmcu=$* $(AVR_CFLAGS) $(AVR_SOURCES) -o $@
	@echo '{"board": "$*", "firmware": "$(VERSION)", "build": "$(BUILD)"}' >$(@:.elf=.json)

# Its main loop hangs while the button is pressed: for the watchdog's test alone.
$(BUILD_DIR)/turnlight-%-hang.elf: $(AVR_DEPENDENCIES) | $(BUILD_DIR)
	@avr-gcc -mmcu=$* $(AVR_CFLAGS) -DTEST_HANG $(AVR_SOURCES) -o $@
