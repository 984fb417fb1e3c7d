#include "fmu_bytes.h"

#include <limits.h>
#include <string.h>

/* Little-endian throughout, so that states pass between machines:
 *
 *     8 bytes    magic
 *     uint32     version of this format
 *     uint64     size of the whole
 *     uint64     checksum (FNV-1a) of what follows
 *     38 bytes   GUID of the FMU
 *     the fields of State
 */
static const char MAGIC[8] = {'s', 't', 'r', 'n', 'd', 's', 'p', 'r'};
enum { VERSION = 1, SIZE_AT = 12, CHECKSUM_AT = 20, GUID_AT = 28 };
enum { FIELDS_AT = GUID_AT + FMU_GUID_SIZE };

void fmu_copy_block(void *to, const volatile void *from, size_t size)
{
    for (size_t i = 0; i < size; i++)
        ((unsigned char *)to)[i] = ((const volatile unsigned char *)from)[i];
}

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

size_t fmu_fields_at(void)
{
    return FIELDS_AT;
}

void fmu_double_field(Cursor *cursor, double *value)
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

void fmu_int_field(Cursor *cursor, int *value)
{
    if (cursor->from != NULL) {
        int64_t number = (int64_t)get_number(cursor->from + cursor->position, 4);
        *value = (int)(number > INT32_MAX ? number - UINT32_MAX - 1 : number);
    } else if (cursor->to != NULL) {
        put_number(cursor->to + cursor->position, (uint64_t)(int64_t)*value, 4);
    }
    cursor->position += 4;
}

static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ bytes[i]) * 0x100000001b3u;
    return sum;
}

void fmu_write_head(unsigned char *bytes, size_t size)
{
    memcpy(bytes, MAGIC, sizeof MAGIC);
    put_number(bytes + sizeof MAGIC, VERSION, SIZE_AT - sizeof MAGIC);
    put_number(bytes + SIZE_AT, size, CHECKSUM_AT - SIZE_AT);
    memcpy(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE);
    put_number(bytes + CHECKSUM_AT, checksum(bytes + GUID_AT, size - GUID_AT), GUID_AT - CHECKSUM_AT);
}

const char *fmu_foreign(const unsigned char *bytes, size_t size, size_t expected)
{
    if (size < GUID_AT || memcmp(bytes, MAGIC, sizeof MAGIC) != 0)
        return "The serialized state is not from a native strandspring FMU.";
    if (get_number(bytes + sizeof MAGIC, SIZE_AT - sizeof MAGIC) != VERSION)
        return "The serialized state has the format of another version of strandspring.";
    if (get_number(bytes + SIZE_AT, CHECKSUM_AT - SIZE_AT) != size ||
        get_number(bytes + CHECKSUM_AT, GUID_AT - CHECKSUM_AT) != checksum(bytes + GUID_AT, size - GUID_AT))
        return "The serialized state is truncated or damaged.";
    if (size < FIELDS_AT || memcmp(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE) != 0 || size != expected)
        return "The serialized state is from another FMU.";
    return NULL;
}
