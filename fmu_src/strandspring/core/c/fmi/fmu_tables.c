#include "fmu_tables.h"

#include <stdlib.h>

#if defined(_MSC_VER) && !defined(__clang__)
#include <intrin.h>
static volatile long locked;
#define TAKE_LOCK() _InterlockedExchange(&locked, 1)
#define DROP_LOCK() (void)_InterlockedExchange(&locked, 0)
#else
#include <stdatomic.h>
static atomic_flag locked = ATOMIC_FLAG_INIT;
#define TAKE_LOCK() atomic_flag_test_and_set_explicit(&locked, memory_order_acquire)
#define DROP_LOCK() atomic_flag_clear_explicit(&locked, memory_order_release)
#endif

typedef struct Entry {
    SharedSpring shared;
    size_t users;
    struct Entry *next;
} Entry;

static Entry *entries; /* guarded by the lock */

/* Held for a few instructions only, never while a table is filled. */
static void lock(void)
{
    while (TAKE_LOCK())
        continue;
}

static Entry *find_entry(const SpringParameters *parameters)
{
    Entry *entry = entries;
    while (entry != NULL && !fmu_fits(&entry->shared.table, parameters))
        entry = entry->next;
    return entry;
}

const SharedSpring *fmu_acquire(const SpringParameters *parameters)
{
    lock();
    Entry *entry = find_entry(parameters);
    if (entry != NULL)
        entry->users++;
    DROP_LOCK();
    if (entry != NULL)
        return &entry->shared;

    Entry *made = calloc(1, sizeof *made);
    if (made == NULL)
        return NULL;
    fmu_tabulate(&made->shared.table, parameters);
    spring_prepare(&made->shared.law, parameters, &made->shared.table);
    made->users = 0;
    lock();
    /* Another thread may have made the same table in the meantime. */
    entry = find_entry(parameters);
    if (entry == NULL) {
        made->next = entries;
        entries = entry = made;
    }
    entry->users++;
    DROP_LOCK();
    if (entry != made)
        free(made);
    return &entry->shared;
}

SharedSpring *fmu_unused_table(void)
{
    SharedSpring *made = malloc(sizeof *made);
    if (made != NULL)
        made->table.n = 0.0;
    return made;
}

void fmu_release(const SharedSpring *shared)
{
    Entry *unused = NULL;
    lock();
    for (Entry **link = &entries; *link != NULL; link = &(*link)->next)
        if (&(*link)->shared == shared) {
            if (--(*link)->users == 0) {
                unused = *link;
                *link = unused->next;
            }
            break;
        }
    DROP_LOCK();
    free(unused);
}
