"""The states of a run."""

from enum import StrEnum


class State(StrEnum):
    """Where the engine is.

                    start            rig ready            all shots, enough, stop
           idle ───────────► homing ───────────► running ────────────────────────► finishing
            ▲                 ▲   │               │ ▲  ▲                             │   ▲
            │                 │   │         pause │ │  └──────────┐                  │   │
            │                 │   │               ▼ │ resume      │ resume           │   │ stop
            │                 │   │            pausing ───────► paused ──────────────┼───┤
            │                 │   │                  shot done                       │   │
            │          resume │   │ fault                                            │   │
            │                 │   ▼                                                  │   │
            │ dismiss        interrupted ◄── fault, stop-now: any of the above ──────┼───┘
            ├─────────────────────┘                                                  │
            ├────────────────────────────────────────────────────────────────────────┘
            │ dismiss
           faulted ◄── a defect of the program: any of the above

    Saved shots are safe in every state. `interrupted` has a cause outside the program, and resuming
    re-homes and goes on; out of `faulted` leads only `dismiss`, and the session is resumed anew. A start
    that finds no rig goes back to `idle`, and no session is made.
    """

    IDLE = "idle"
    HOMING = "homing"
    RUNNING = "running"
    PAUSING = "pausing"
    PAUSED = "paused"
    INTERRUPTED = "interrupted"
    FINISHING = "finishing"
    FAULTED = "faulted"


class Step(StrEnum):
    """How far a shot has come; it survives a crash from `saved` on."""

    PLANNED = "planned"
    POSITIONED = "positioned"
    SETTLED = "settled"
    LIT = "lit"
    EXPOSED = "exposed"
    VERIFIED = "verified"
    SAVED = "saved"
    ENCODED = "encoded"
