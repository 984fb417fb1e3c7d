#include "fmi2_tables.h"

#if defined(_MSC_VER) && !defined(__clang__)
#include <intrin.h>
static volatile long locked;
#define TAKE_LOCK() _InterlockedExchange(&locked, 1)
#define DROP_LOCK() _InterlockedExchange(&locked, 0)
#else
#include <stdatomic.h>
static atomic_flag locked = ATOMIC_FLAG_INIT;
#define TAKE_LOCK() atomic_flag_test_and_set_explicit(&locked, memory_order_acquire)
#define DROP_LOCK() atomic_flag_clear_explicit(&locked, memory_order_release)
#endif

/* One shared table; `table` comes shared_tables, so that its address is that of the whole. */
typedef struct Shared {
    SpringTable table;
    size_t users;
    fmi2CallbackFreeMemory free;
    struct Shared *next;
} Shared;

static Shared *shared_tables; /* guarded by the lock */

/* Held for a few instructions only, never while a table is filled. */
static void lock(void)
{
    while (TAKE_LOCK())
        continue;
}

static void unlock(void)
{
    DROP_LOCK();
}

static Shared *find_shared(double n, double curvature)
{
    Shared *shared = shared_tables;
    while (shared != NULL && !(shared->table.n == n && shared->table.curvature == curvature))
        shared = shared->next;
    return shared;
}

const SpringTable *fmu_acquire_table(const Allocator *allocator, double n, double sigma)
{
    const double curvature = 2.0 * sigma - 1.0;
    lock();
    Shared *shared = find_shared(n, curvature);
    if (shared != NULL)
        shared->users++;
    unlock();
    if (shared != NULL)
        return &shared->table;

    Shared *made = allocator->allocate(1, sizeof *made);
    if (made == NULL)
        return NULL;
    spring_tabulate(&made->table, n, sigma, SPRING_WITH_DERIVATIVES | SPRING_WITH_MOMENTS);
    made->users = 0;
    made->free = allocator->free;
    lock();
    /* Another thread may have made the same table in the meantime. */
    shared = find_shared(n, curvature);
    if (shared == NULL) {
        made->next = shared_tables;
        shared_tables = shared = made;
    }
    shared->users++;
    unlock();
    if (shared != made)
        made->free(made);
    return &shared->table;
}

void fmu_release_table(const SpringTable *table)
{
    Shared *unused = NULL;
    lock();
    for (Shared **link = &shared_tables; *link != NULL; link = &(*link)->next)
        if (&(*link)->table == table) {
            if (--(*link)->users == 0) {
                unused = *link;
                *link = unused->next;
            }
            break;
        }
    unlock();
    if (unused != NULL)
        unused->free(unused);
}
