/* What differs from rig to rig, set by the host and kept in EEPROM.
 *
 * The block there carries a version and a CRC. If either is wrong, every parameter has its default,
 * and the host is told so at hello. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "flash.h"
#include "line.h"
#include "reason.h"

enum parameter {
    FULL_STEPS, /* of the motor, a turn */
    MICROSTEPS, /* as the driver's switches are set */
    MOTOR_TEETH,
    TABLE_TEETH,
    REVERSED, /* 1: the motor turns the other way */
    START_SPEED, /* centidegrees/s of the table: what it starts and stops at without a ramp */
    TOP_SPEED,
    ACCELERATION, /* centidegrees/s^2 */
    HOME_SPEED,   /* to find the mark */
    INDEX_SPEED,  /* to find the mark's edge, at most START_SPEED */
    LED_MA,       /* of one LED with all its channels at 255 */
    SUPPLY_MA,    /* what all LEDs together may take */
    LED_LIMIT_MS, /* each LED's own longest time */
    SETTLE_US,    /* from a frame on the wire to steady light */
    PARAMETER_COUNT,
};

void parameters_init(void);
int32_t parameter(enum parameter parameter);
uint16_t steps_per_turn(void);             /* of the table */
uint16_t steps_per_second(int32_t speed);  /* of a speed in centidegrees/s */
uint16_t steps_per_second_per_ms(void);    /* the acceleration */
const FLASH char *parameters_origin(void); /* where they came from: kept, default or corrupt */

/* False if there is none of this name. */
bool parameter_find(const char *name, enum parameter *found);
void parameter_report(enum parameter parameter, struct line *line);

/* Sets and keeps it; takes some ms. REASON_RANGE if it, or what follows from it, is out of range. */
enum reason parameter_set(enum parameter parameter, int32_t value);
