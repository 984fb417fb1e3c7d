/* Serialized states of the Python-backed FMU, which are JSON: whole, damaged, of another FMU, and made up. */
#include "../fuzz.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 20000 };

typedef struct {
    char text[MOST];
    int size;
} Text;

/* Puts other text in place of so many characters. */
static void replace(Text *in, int at, int count, const char *by, int size)
{
    if (in->size - count + size > MOST)
        return;
    memmove(in->text + at + size, in->text + at + count, (size_t)(in->size - at - count));
    memcpy(in->text + at, by, (size_t)size);
    in->size += size - count;
}

static int length_of(const unsigned char *bytes)
{
    int size = (int)state_size();
    while (size > 0 && bytes[size - 1] == ' ')
        size--;
    return size;
}

static void replace_number(Text *in)
{
    static const char *const strange[] = {"NaN", "Infinity", "-Infinity", "1e999", "true", "null", "[]", "{}", "\"\"",
                                          "-0.0", "123456789012345678901234567890", "3", "-1", "[[0.0]]",
                                          "1e154", "\"\xff\""};
    char number[40];
    int from = below(in->size), to;
    while (from < in->size && !isdigit((unsigned char)in->text[from]))
        from++;
    for (to = from; to < in->size && strchr("0123456789.+-e", in->text[to]) != NULL;)
        to++;
    snprintf(number, sizeof number, "%.17g", chance(50) ? awkward() : usual_displacement());
    const char *by = chance(40) ? strange[below(sizeof strange / sizeof *strange)] : number;
    replace(in, from, to - from, by, (int)strlen(by));
}

static void damage_text(Text *in, const unsigned char *other)
{
    char slice[200];
    int at = below(in->size), count = below(in->size - at < 200 ? in->size - at : 200);
    memcpy(slice, in->text + at, (size_t)count);
    switch (below(8)) {
    case 0: in->text[at] = (char)(in->text[at] ^ 1 << below(8)); break;
    case 1: replace(in, at, count, "", 0); break;
    case 2: replace(in, at, 0, slice, count); break;
    case 3: memcpy(in->text + at, other + at, (size_t)count); break;
    case 4:
        memset(slice, chance(50) ? '[' : '9', sizeof slice);
        for (int k = below(60); k > 0; k--)
            replace(in, at, 0, slice, sizeof slice);
        break;
    default: replace_number(in);
    }
}

Serialized made_up(const unsigned char *bytes, const unsigned char *part)
{
    Text made = {.size = length_of(bytes)};
    memcpy(made.text, bytes, (size_t)made.size);
    for (int k = 1 + below(3); k > 0 && made.size > 0; k--)
        damage_text(&made, part == NULL ? bytes : part);
    if (made.size == 0)
        made = (Text){" ", 1};
    return (Serialized){exactly(made.text, (size_t)made.size), (size_t)made.size, CRAFTED};
}

Serialized serialized_from(const unsigned char *bytes, const unsigned char *other, size_t other_size)
{
    size_t whole = state_size(), written = (size_t)length_of(bytes);
    if (!careless() && chance(60))
        return (Serialized){exactly(bytes, whole), whole, SOUND};
    switch (below(4)) {
    case 0: /* cut off */
        written = (size_t)below((int)written);
        return (Serialized){exactly(bytes, written), written, BROKEN};
    case 1:
        return (Serialized){exactly(other, other_size), other_size, other_size == whole ? CRAFTED : BROKEN};
    default: return made_up(bytes, other_size == whole ? other : NULL);
    }
}
