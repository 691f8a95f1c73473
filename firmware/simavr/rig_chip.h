// SPDX-License-Identifier: GPL-3.0-or-later
/* What the rig around a chip needs beyond native/rig.h. */
#pragma once

void rig_open(const char *elf); /* once, before all else */
