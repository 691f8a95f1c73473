#include "parameters.h"

#include "config.h"
#include "crc.h"
#include "hal.h"

/* In EEPROM: version, values with the lowest byte first, CRC. */
#define VERSION 1
_Static_assert(1 + sizeof(int32_t) * PARAMETER_COUNT + 2 <= HAL_EEPROM_SIZE, "EEPROM is too small");

#define TURN_LOWEST 400
#define TURN_HIGHEST 58000 /* steps; an eighth more still fits 16 bits */
#define RATE_LOWEST 16
#define RATE_HIGHEST 20000 /* steps/s */
#define BRAKING_HIGHEST_MS 400 /* with the lease, well within 1.5 s */

static const FLASH struct {
    char name[13];
    int32_t lowest, highest, initial;
} table[PARAMETER_COUNT] = {
    [FULL_STEPS] = {"full_steps", 20, 400, 200},
    [MICROSTEPS] = {"microsteps", 1, 256, 16},
    [MOTOR_TEETH] = {"motor_teeth", 1, 255, 20},
    [TABLE_TEETH] = {"table_teeth", 1, 255, 100},
    [REVERSED] = {"reversed", 0, 1, 0},
    [START_SPEED] = {"start_speed", 100, 72000, 4500},
    [TOP_SPEED] = {"top_speed", 100, 72000, 18000}, /* a sample that lies loose must not slide */
    [ACCELERATION] = {"acceleration", 1000, 1000000, 45000},
    [HOME_SPEED] = {"home_speed", 100, 72000, 9000},
    [INDEX_SPEED] = {"index_speed", 100, 72000, 900},
    [LED_MA] = {"led_ma", 1, 1000, 60},
    [SUPPLY_MA] = {"supply_ma", 1, 60000, 2400},
    [LED_LIMIT_MS] = {"led_limit_ms", 100, 60000, 20000},
    [SETTLE_US] = {"settle_us", 0, 1000000, 2000},
};

static const FLASH char origins[][8] = {"kept", "default", "corrupt"};
enum origin { KEPT, DEFAULT, CORRUPT };

static int32_t values[PARAMETER_COUNT];
static enum origin origin;

static enum origin load(void);
static void keep(void);
static uint16_t write_byte(uint8_t address, uint8_t byte, uint16_t crc);
static bool all_in_range(void);
static uint32_t braking_ms(void);
static uint32_t homing_overshoot(void);
static uint32_t turn(void);
static uint32_t rate(int32_t speed);

void parameters_init(void)
{
    origin = load();
    if (origin == KEPT)
        return;
    for (uint8_t i = 0; i < PARAMETER_COUNT; i++)
        values[i] = table[i].initial;
}

int32_t parameter(enum parameter parameter)
{
    return values[parameter];
}

uint16_t steps_per_turn(void)
{
    return (uint16_t)turn();
}

uint16_t steps_per_second(int32_t speed)
{
    return (uint16_t)rate(speed);
}

uint16_t steps_per_second_per_ms(void)
{
    uint32_t degrees_per_s2 = (uint32_t)values[ACCELERATION] / 100;
    return (uint16_t)(degrees_per_s2 * steps_per_turn() / 360 / 1000);
}

const FLASH char *parameters_origin(void)
{
    return origins[origin];
}

bool parameter_find(const char *name, enum parameter *found)
{
    for (uint8_t i = 0; i < PARAMETER_COUNT; i++) {
        if (line_same_word(name, table[i].name)) {
            *found = (enum parameter)i;
            return true;
        }
    }
    return false;
}

void parameter_report(enum parameter parameter, struct line *line)
{
    line_text(line, " ");
    line_word(line, table[parameter].name);
    line_text(line, "=");
    line_integer(line, values[parameter]);
    line_field(line, "lowest");
    line_integer(line, table[parameter].lowest);
    line_field(line, "highest");
    line_integer(line, table[parameter].highest);
    line_field(line, "default");
    line_integer(line, table[parameter].initial);
}

enum reason parameter_set(enum parameter parameter, int32_t value)
{
    int32_t before = values[parameter];
    values[parameter] = value;
    if (!all_in_range()) {
        values[parameter] = before;
        return REASON_RANGE;
    }
    keep();
    return REASON_NONE;
}

static enum origin load(void)
{
    uint8_t address = 0, version = hal_eeprom_read(address++);
    uint16_t crc = crc16_add(CRC_SEED, version);
    for (uint8_t i = 0; i < PARAMETER_COUNT; i++) {
        uint32_t value = 0;
        for (uint8_t shift = 0; shift < 32; shift = (uint8_t)(shift + 8)) {
            uint8_t byte = hal_eeprom_read(address++);
            crc = crc16_add(crc, byte);
            value |= (uint32_t)byte << shift;
        }
        values[i] = (int32_t)value;
    }
    uint16_t kept = hal_eeprom_read(address++);
    kept = (uint16_t)(kept | (uint16_t)hal_eeprom_read(address) << 8);
    if (version == VERSION && crc == kept && all_in_range())
        return KEPT;
    bool blank = version == 0xFF && values[0] == -1 && kept == 0xFFFF;
    return blank ? DEFAULT : CORRUPT;
}

static void keep(void)
{
    uint8_t address = 0;
    uint16_t crc = write_byte(address++, VERSION, CRC_SEED);
    for (uint8_t i = 0; i < PARAMETER_COUNT; i++)
        for (uint8_t shift = 0; shift < 32; shift = (uint8_t)(shift + 8))
            crc = write_byte(address++, (uint8_t)((uint32_t)values[i] >> shift), crc);
    write_byte(address++, (uint8_t)crc, 0);
    write_byte(address, (uint8_t)(crc >> 8), 0);
    origin = KEPT;
}

/* A byte that is there already costs neither time nor wear. */
static uint16_t write_byte(uint8_t address, uint8_t byte, uint16_t crc)
{
    if (hal_eeprom_read(address) != byte)
        hal_eeprom_write(address, byte);
    return crc16_add(crc, byte);
}

static bool all_in_range(void)
{
    for (uint8_t i = 0; i < PARAMETER_COUNT; i++)
        if (values[i] < table[i].lowest || values[i] > table[i].highest)
            return false;
    return turn() >= TURN_LOWEST && turn() <= TURN_HIGHEST
        && values[INDEX_SPEED] <= values[START_SPEED] && values[START_SPEED] <= values[HOME_SPEED]
        && values[HOME_SPEED] <= values[TOP_SPEED] && rate(values[INDEX_SPEED]) >= RATE_LOWEST
        && rate(values[TOP_SPEED]) <= RATE_HIGHEST && steps_per_second_per_ms() > 0
        && homing_overshoot() <= turn() / 4 && braking_ms() <= BRAKING_HIGHEST_MS;
}

static uint32_t braking_ms(void)
{
    uint32_t change = rate(values[TOP_SPEED]) - rate(values[START_SPEED]);
    return change / steps_per_second_per_ms();
}

static uint32_t homing_overshoot(void)
{
    uint32_t home_rate = rate(values[HOME_SPEED]);
    return home_rate * home_rate / ((uint32_t)2000 * steps_per_second_per_ms());
}

/* A belt's ratio need not give whole steps; what is rounded away is half a step a turn at most. */
static uint32_t turn(void)
{
    uint32_t motor = (uint32_t)values[FULL_STEPS] * (uint32_t)values[MICROSTEPS];
    uint32_t teeth = (uint32_t)values[MOTOR_TEETH];
    return (motor * (uint32_t)values[TABLE_TEETH] + teeth / 2) / teeth;
}

static uint32_t rate(int32_t speed)
{
    return (uint32_t)speed * turn() / CENTIDEGREES_PER_TURN;
}
