#include "shot.h"

#include "hal.h"
#include "safety.h"

#include <stddef.h>

static int32_t last_id = -1;

void shot_forget(void)
{
    last_id = -1;
}

const char *shot_fire(int32_t id)
{
    if (safety_fault() != FAULT_NONE)
        return fault_word(safety_fault());
    if (id <= last_id)
        return "spent";
    last_id = id;
    hal_strobe();
    return NULL;
}
