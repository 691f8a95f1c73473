#include "entropy.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/random.h>

uint32_t entropy(void)
{
    uint32_t value;
    if (getrandom(&value, sizeof value, 0) != sizeof value) {
        perror("turnlight-native: getrandom");
        exit(1);
    }
    return value;
}
