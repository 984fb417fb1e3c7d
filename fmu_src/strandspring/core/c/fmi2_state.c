#include "fmi2_state.h"

#include "fmi2_block.h"
#include "fmi2_states.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* Little-endian throughout, so that states pass between machines:
 *
 *     8 bytes    magic
 *     uint32     version of this format
 *     uint64     size of the whole
 *     uint64     checksum (FNV-1a) of what follows
 *     38 bytes   GUID of the FMU
 *     the fields of State in the order of fields() below: int as two's complement in 32 bits, double in IEEE 754
 */
static const char MAGIC[8] = {'s', 't', 'r', 'n', 'd', 's', 'p', 'r'};
enum { VERSION = 1, SIZE_AT = 12, CHECKSUM_AT = 20, GUID_AT = 28};
enum { FIELDS_AT = GUID_AT + FMU_GUID_SIZE };

/* A position in the bytes; fields() counts when there are none to read or write. */
typedef struct {
    const unsigned char *from;
    unsigned char *to;
    size_t position;
} Cursor;

static uint64_t get_number(const unsigned char *bytes, int size)
{
    uint64_t number = 0;
    for (int i = size - 1; i >= 0; i--)
        number = number << CHAR_BIT | bytes[i];
    return number;
}

static void put_number(unsigned char *bytes, uint64_t number, int size)
{
    for (int i = 0; i < size; i++) {
        bytes[i] = (unsigned char)(number & UCHAR_MAX);
        number >>= CHAR_BIT;
    }
}

static void double_field(Cursor *cursor, double *value)
{
    uint64_t bits;
    if (cursor->from != NULL) {
        bits = get_number(cursor->from + cursor->position, 8);
        memcpy(value, &bits, sizeof bits);
    } else if (cursor->to != NULL) {
        memcpy(&bits, value, sizeof bits);
        put_number(cursor->to + cursor->position, bits, 8);
    }
    cursor->position += 8;
}

static void int_field(Cursor *cursor, int *value)
{
    if (cursor->from != NULL) {
        int64_t number = (int64_t)get_number(cursor->from + cursor->position, 4);
        *value = (int)(number > INT32_MAX ? number - UINT32_MAX - 1 : number);
    } else if (cursor->to != NULL) {
        put_number(cursor->to + cursor->position, (uint64_t)(int64_t)*value, 4);
    }
    cursor->position += 4;
}

static void fields(Cursor *cursor, State *state)
{
    SpringMemory *memory = &state->memory;
    SpringSensitivity *sensitivity = &state->sensitivity;
    ReversalWatch *watch = &state->watch;
    int_field(cursor, &state->mode);
    double_field(cursor, &state->time);
    double_field(cursor, &state->stop_time);
    for (unsigned i = SPRING_FIRST_PARAMETER; i < fmu_first_own(&state->settings); i++)
        double_field(cursor, fmu_setting(&state->settings, i));
    double_field(cursor, &state->settings.omega_start);
    double_field(cursor, &state->displacement);
    double_field(cursor, &state->velocity);
    double_field(cursor, &state->acceleration);
    int_field(cursor, &state->interpolated);
    double_field(cursor, &memory->displacement);
    double_field(cursor, &memory->omega);
    int_field(cursor, &memory->direction);
    double_field(cursor, &memory->start);
    double_field(cursor, &memory->start_xi);
    double_field(cursor, &memory->energy_at);
    double_field(cursor, &memory->energy);
    double_field(cursor, &sensitivity->by_rho);
    double_field(cursor, &sensitivity->by_sigma);
    double_field(cursor, &sensitivity->by_n);
    double_field(cursor, &sensitivity->by_omega_start);
    double_field(cursor, &state->rate);
    int_field(cursor, &state->energy_wanted);
    int_field(cursor, &state->side);
    int_field(cursor, &state->extrapolating);
    int_field(cursor, &watch->count);
    for (int i = 0; i < 2; i++) {
        double_field(cursor, &watch->time[i]);
        double_field(cursor, &watch->displacement[i]);
    }
    int_field(cursor, &watch->heading);
    double_field(cursor, &watch->turn);
    double_field(cursor, &watch->slack);
}

static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ bytes[i]) * 0x100000001b3u;
    return sum;
}

size_t fmu_state_size(void)
{
    State any = {.settings = fmu_start_settings()};
    Cursor cursor = {NULL, NULL, FIELDS_AT};
    fields(&cursor, &any);
    return cursor.position;
}

void fmu_state_write(const State *state, unsigned char *bytes)
{
    State copy = *state;
    Cursor cursor = {NULL, bytes, FIELDS_AT};
    fields(&cursor, &copy);
    memcpy(bytes, MAGIC, sizeof MAGIC);
    put_number(bytes + sizeof MAGIC, VERSION, SIZE_AT - sizeof MAGIC);
    put_number(bytes + SIZE_AT, cursor.position, CHECKSUM_AT - SIZE_AT);
    memcpy(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE);
    put_number(bytes + CHECKSUM_AT, checksum(bytes + GUID_AT, cursor.position - GUID_AT), GUID_AT - CHECKSUM_AT);
}

static int is_flag(int value)
{
    return value == 0 || value == 1;
}

static int is_side(int value)
{
    return value >= -1 && value <= 1;
}

/* Whether the path and what it inherits are such that nothing made of them overflows. */
static int is_sound(const SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    const double places[] = {memory->displacement, memory->start, memory->energy_at};
    const double sums[] = {memory->energy, sensitivity->by_rho, sensitivity->by_sigma, sensitivity->by_n,
                           sensitivity->by_omega_start};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        if (!(fabs(places[i]) <= LARGEST_DISPLACEMENT))
            return 0;
    for (size_t i = 0; i < sizeof sums / sizeof *sums; i++)
        if (!(fabs(sums[i]) <= LARGEST_SUM))
            return 0;
    return is_side(memory->direction) && fabs(memory->start_xi) <= LARGEST_START_XI;
}

/* Whether a memory is one of the form with states, which has no table to follow a path by. */
static int has_no_path(const SpringMemory *memory, double displacement)
{
    return memory->displacement == displacement && memory->start == displacement && memory->energy_at == displacement &&
           memory->start_xi == 0.0;
}

/* The first field that no instance can have, or NULL. */
static const char *damaged_field(const State *state)
{
    const SpringMemory *memory = &state->memory;
    Settings settings = state->settings;
    if ((state->mode & ANY_MODE) != state->mode || state->mode == 0 || (state->mode & (state->mode - 1)) != 0)
        return "mode";
    if (!isfinite(state->time) || isnan(state->stop_time))
        return "time";
    if (!(fabs(state->displacement) <= LARGEST_DISPLACEMENT))
        return "displacement";
    if (settings.has_states ? !(fabs(state->velocity) <= LARGEST_VELOCITY) : !isfinite(state->velocity))
        return "velocity";
    if (!isfinite(state->acceleration) || !is_flag(state->interpolated) || !isfinite(state->rate))
        return "input derivatives";
    /* Solvers overshoot a state. */
    double largest = state->settings.has_states ? LARGEST_SUM : 1.0;
    if (!(fabs(memory->omega) <= largest) || !is_sound(memory, &state->sensitivity) ||
        (settings.has_states && !has_no_path(memory, state->displacement)))
        return "memory";
    for (unsigned i = SPRING_FIRST_PARAMETER; i < fmu_first_own(&settings); i++)
        if (!isfinite(*fmu_setting(&settings, i)))
            return "settings";
    if (!isfinite(settings.omega_start))
        return "settings";
    if (!is_flag(state->energy_wanted) || !is_side(state->side) || !is_flag(state->extrapolating))
        return "flags";
    if (!fmu_watch_is_sound(&state->watch))
        return "watch";
    return state->mode & (INITIALIZED | TERMINATED) && !(fabs(state->settings.omega_start) <= 1.0) ? "omega_start" : NULL;
}

/* The reason why the bytes are not a state of this FMU, apart from its fields; NULL if there is none. */
static const char *foreign(const unsigned char *bytes, size_t size)
{
    if (size < GUID_AT || memcmp(bytes, MAGIC, sizeof MAGIC) != 0)
        return "The serialized state is not from a native strandspring FMU.";
    if (get_number(bytes + sizeof MAGIC, SIZE_AT - sizeof MAGIC) != VERSION)
        return "The serialized state has the format of another version of strandspring.";
    if (get_number(bytes + SIZE_AT, CHECKSUM_AT - SIZE_AT) != size ||
        get_number(bytes + CHECKSUM_AT, GUID_AT - CHECKSUM_AT) != checksum(bytes + GUID_AT, size - GUID_AT))
        return "The serialized state is truncated or damaged.";
    if (size < FIELDS_AT || memcmp(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE) != 0 || size != fmu_state_size())
        return "The serialized state is from another FMU.";
    return NULL;
}

int fmu_state_read(State *state, const unsigned char *bytes, size_t size, char *problem, size_t problem_size)
{
    const char *reason = foreign(bytes, size);
    if (reason != NULL) {
        snprintf(problem, problem_size, "%s", reason);
        return 1;
    }
    Cursor cursor = {bytes, NULL, FIELDS_AT};
    state->settings = fmu_start_settings(); /* for the numbers of coefficients */
    fields(&cursor, state);
    const char *field = damaged_field(state);
    if (field != NULL) {
        snprintf(problem, problem_size, "The serialized state is damaged in its field `%s`.", field);
        return 1;
    }
    return state->mode & (INITIALIZED | TERMINATED) ? spring_problem(&state->settings.spring, problem, problem_size) : 0;
}
