/* Outputs and inputs of hal.h. */
#include "pins.h"

#include "hal.h"

void hal_step_direction(bool positive)
{
    if (positive)
        pin_high(PIN_DIRECTION);
    else
        pin_low(PIN_DIRECTION);
}

void hal_motor_enable(bool on)
{
    if (on)
        pin_low(PIN_ENABLE);
    else
        pin_high(PIN_ENABLE);
}

void hal_led_supply(bool on)
{
    if (on)
        pin_high(PIN_LED_SUPPLY);
    else
        pin_low(PIN_LED_SUPPLY);
}

void hal_strobe(bool high)
{
    if (high)
        pin_high(PIN_STROBE);
    else
        pin_low(PIN_STROBE);
}

bool hal_index(void)
{
    return !pin_is_high(PIN_INDEX);
}

/* A normally closed switch to ground: a broken wire reads as pressed. */
bool hal_estop_pressed(void)
{
    return pin_is_high(PIN_ESTOP);
}

bool hal_button_pressed(void)
{
    return !pin_is_high(PIN_BUTTON);
}

const char *hal_board(void)
{
    return BOARD;
}
