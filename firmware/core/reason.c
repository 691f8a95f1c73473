#include "reason.h"

static const FLASH char words[][7] = {
    [REASON_NONE] = "none",
    [REASON_STOP] = "stop",
    [REASON_ESTOP] = "estop",
    [REASON_LEASE] = "lease",
    [REASON_INDEX] = "index",
    [REASON_VERB] = "verb",
    [REASON_COUNT] = "count",
    [REASON_RANGE] = "range",
    [REASON_NAME] = "name",
    [REASON_HOME] = "home",
    [REASON_BUSY] = "busy",
    [REASON_HOT] = "hot",
    [REASON_SUPPLY] = "supply",
    [REASON_SPENT] = "spent",
    [REASON_CHECK] = "check",
    [REASON_FORM] = "form",
    [REASON_LONG] = "long",
};

const FLASH char *reason_word(enum reason reason)
{
    return words[reason];
}
