/* Why the rig stands still, or why a command is not done: one list, and its words on the wire. */
#pragma once

#include "flash.h"

enum reason {
    REASON_NONE,

    /* faults */
    REASON_STOP,  /* the stop byte or verb, or a long press of the button */
    REASON_ESTOP, /* the emergency stop is, or was, pressed */
    REASON_LEASE, /* the host fell silent while something was lit or turning */
    REASON_INDEX, /* homing did not find the mark */

    /* refusals of one command */
    REASON_VERB,
    REASON_COUNT,
    REASON_RANGE,
    REASON_NAME,
    REASON_HOME,
    REASON_BUSY,
    REASON_HOT,
    REASON_SUPPLY,
    REASON_SPENT,

    /* lines that cannot be read */
    REASON_CHECK,
    REASON_FORM,
    REASON_LONG,
};

const FLASH char *reason_word(enum reason reason);
