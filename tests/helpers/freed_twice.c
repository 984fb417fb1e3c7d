/* Preloaded, ends the process with status 86 where a shared pointer of C++ frees its object a second time.
 *
 * Freed memory is never given back: it is left as the count of one last pointer, whose functions end the process.
 */
#include <stddef.h>
#include <unistd.h>

static void freed_twice(void)
{
    _exit(86);
}

static void (*const functions[])(void) = {freed_twice, freed_twice, freed_twice, freed_twice, freed_twice};

typedef struct {
    void (*const *functions)(void);
    int pointers, weak_pointers;
} Count;

/* operator delete(void *, std::size_t) */
void _ZdlPvm(void *block, size_t size)
{
    if (size >= sizeof(Count))
        *(Count *)block = (Count){functions, 1, 1};
}
