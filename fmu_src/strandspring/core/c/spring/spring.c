#include "spring.h"

#include "numerics.h"
#include "spring_library.h"

#include <float.h>
#include <stdint.h>

/* ---- law.py ----------------------------------------------------------------------------------------------------- */

static void antiderivative(const double *coefficients, int count, double *of)
{
    of[0] = 0.0;
    for (int i = 0; i < count; i++)
        of[i + 1] = coefficients[i] / (i + 1);
}

/* A block or a run of them may be twice this share of the range, and the first blocks together this one. */
static const double WIDEST_SHARE = 0.51, CORE_SHARE = 0.06;

enum { MOST_POWER = SPRING_BLOCK_POWERS + SPRING_COEFFICIENTS };

/* What prepares the works of whole blocks: FA(x + t) is the sum of taylor[k][m]*x^k*t^m. */
typedef struct {
    double taylor[SPRING_COEFFICIENTS][SPRING_COEFFICIENTS], two_by[MOST_POWER], factorial[SPRING_COEFFICIENTS];
} Expansion;

/* Over a whole block, x = middle + per_z*half*theta, FA expanded by powers of theta, whose integrals with |W| are easy,
 * gives a polynomial of the middle. */
static void prepare_block_work(SpringLaw *law, const Expansion *of, int falls, int index)
{
    const SpringBlocks *blocks = falls ? &law->table->falling.blocks : &law->table->rising.blocks;
    const double *c = blocks->coefficients[index];
    int count = law->parameters.amplifier;
    double half = 1.0 / blocks->per_half[index], reach = half / law->parameters.rho;
    double moment[SPRING_COEFFICIENTS], power = half;
    /* None that is wider than the range lies in it. */
    if (reach > WIDEST_SHARE * (law->x_max - law->x_min))
        return;
    for (int m = 0; m < count; m++, power *= reach) {
        double total = 0.0;
        for (int k = m % 2; k < SPRING_BLOCK_POWERS; k += 2)
            total += c[k] * of->two_by[k + m + 1];
        moment[m] = power * total;
    }
    for (int k = 0; k < count; k++) {
        double even = 0.0, odd = 0.0;
        for (int m = 0; m + k < count; m += 2)
            even += of->taylor[k][m] * moment[m];
        for (int m = 1; m + k < count; m += 2)
            odd += of->taylor[k][m] * moment[m];
        law->block_work[falls][0][index / 2][k][index % 2] = even - odd;
        law->block_work[falls][1][index / 2][k][index % 2] = even + odd;
    }
}

/* Adds c(x + shift) to sum(x), as coefficients of one of two blocks lie. */
static void add_shifted(const Expansion *of, const double (*c)[2], int count, double shift, double (*sum)[2])
{
    double scaled[SPRING_COEFFICIENTS], power[SPRING_COEFFICIENTS];
    for (int k = 0; k < count; k++) {
        scaled[k] = of->factorial[k] * c[k][0];
        power[k] = k > 0 ? power[k - 1] * shift / k : 1.0;
    }
    for (int m = 0; m < count; m++) {
        double total = 0.0;
        for (int k = m; k < count; k++)
            total += scaled[k] * power[k - m];
        sum[m][0] += total / of->factorial[m];
    }
}

/* Adds up the polynomials of each run of blocks, and of the first blocks. */
static void prepare_runs(SpringLaw *law, const Expansion *of, int falls)
{
    const SpringBlocks *blocks = falls ? &law->table->falling.blocks : &law->table->rising.blocks;
    int count = law->parameters.amplifier, core = 0;
    double range = law->parameters.rho * (law->x_max - law->x_min);
    while (core < blocks->count && blocks->ends[core + 1] <= CORE_SHARE * range)
        core++;
    if (core < blocks->count)
        core -= core % SPRING_RUN;
    law->core[falls] = core;
    for (int grows = 0; grows < 2; grows++) {
        double per_z = (grows ? 1.0 : -1.0) / law->parameters.rho, core_work[SPRING_COEFFICIENTS][2] = {{0.0}};
        for (int i = 0; i < blocks->count; i++) {
            int64_t run = i / SPRING_RUN;
            const double(*work)[2] = (const double(*)[2])&law->block_work[falls][grows][i / 2][0][i % 2];
            double(*sum)[2] = (double(*)[2])&law->run_work[falls][grows][run / 2][0][run % 2];
            if (i < core)
                add_shifted(of, work, count, per_z * (blocks->middle[i] - 0.5 * blocks->ends[core]), core_work);
            if ((run + 1) * SPRING_RUN <= blocks->count
                && blocks->ends[(run + 1) * SPRING_RUN] - blocks->ends[run * SPRING_RUN] <= 2.0 * WIDEST_SHARE * range)
                add_shifted(of, work, count, per_z * (blocks->middle[i] - blocks->run_middle[run]), sum);
        }
        for (int k = 0; k < count; k++)
            law->core_work[falls][grows][k] = core_work[k][0];
    }
}

static void prepare_block_works(SpringLaw *law)
{
    Expansion of = {.factorial = {1.0}};
    const SpringParameters *p = &law->parameters;
    for (int i = 0; i < p->amplifier; i++) {
        double binomial = 1.0;
        for (int m = 0; m <= i; m++) {
            of.taylor[i - m][m] = binomial * p->kA[i];
            binomial = binomial * (i - m) / (m + 1);
        }
    }
    for (int i = 1; i < MOST_POWER; i++)
        of.two_by[i] = 2.0 / i;
    for (int i = 1; i < SPRING_COEFFICIENTS; i++)
        of.factorial[i] = i * of.factorial[i - 1];
    memset(law->block_work, 0, sizeof law->block_work);
    memset(law->run_work, 0, sizeof law->run_work);
    memset(law->core_work, 0, sizeof law->core_work);
    memset(law->FA, 0, sizeof law->FA);
    memcpy(law->FA, p->kA, (size_t)p->amplifier * sizeof *p->kA);
    for (int falls = 0; falls < 2; falls++) {
        int count = falls ? law->table->falling.blocks.count : law->table->rising.blocks.count;
        for (int k = 0; k < count; k++)
            prepare_block_work(law, &of, falls, k);
        prepare_runs(law, &of, falls);
    }
}

/* ---- restoring.py ----------------------------------------------------------------------------------------------- */

/* FE within the range, and its slope. */
static double elastic_inside(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0)
        return polynomial(p->kE, p->elastic, x);
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_force(&law->spline, i, x - law->spline.knots[i]);
}

static double elastic_slope(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0)
        return polynomial(law->dFE, slope_count(p->elastic), x);
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_slope(&law->spline, i, x - law->spline.knots[i]);
}

static double elastic_force(const SpringLaw *law, double x)
{
    double inside = clip(x, law->x_min, law->x_max);
    double out = x - inside;
    double force = elastic_inside(law, inside);
    return out == 0.0 ? force : force + elastic_slope(law, inside) * out;
}

static double amplifier(const SpringLaw *law, double x)
{
    return polynomial(law->parameters.kA, law->parameters.amplifier, clip(x, law->x_min, law->x_max));
}

void spring_prepare(SpringLaw *law, const SpringParameters *parameters, const SpringTable *table)
{
    law->parameters = *parameters;
    law->table = table;
    const SpringParameters *p = &law->parameters;
    if (p->knots) {
        spring_spline(&law->spline, p->knots, p->FE_knots, p->FE_forces, p->displacement_offset);
    } else {
        derivative(p->kE, p->elastic, law->dFE);
    }
    derivative(p->kA, p->amplifier, law->dFA);
    law->x_min = p->displacement_min - p->displacement_offset;
    law->x_max = p->displacement_max - p->displacement_offset;
    /* A polynomial of degree M may change by all of itself over 1/M^2 of half its range (Markov); per unit of xi. */
    int degree = p->amplifier - 1;
    law->roughness = 2.0 * degree * degree / p->rho / (law->x_max - law->x_min);
    double end[2] = {law->x_min, law->x_max};
    for (int k = 0; k < 2; k++) {
        law->FE_outside[k] = elastic_inside(law, end[k]);
        law->FE_slope_outside[k] = elastic_slope(law, end[k]);
        law->FA_outside[k] = amplifier(law, end[k]);
    }
    memset(law->FE_work, 0, sizeof law->FE_work);
    antiderivative(p->kE, p->elastic, law->FE_work);
    law->has_energy = table != NULL && table->has_energies;
    if (law->has_energy)
        prepare_block_works(law);
}

double spring_force(const SpringLaw *law, const SpringMemory *memory)
{
    double x = memory->displacement - law->parameters.displacement_offset;
    return elastic_force(law, x) + law->parameters.kappa_omega * memory->omega * amplifier(law, x);
}

double spring_stiffness(const SpringLaw *law, const SpringMemory *memory)
{
    const SpringParameters *p = &law->parameters;
    double x = memory->displacement - p->displacement_offset, omega = memory->omega;
    double u = memory->direction < 0 ? -omega : omega;
    double slope = 1.0 + (u >= 0.0 ? -1.0 : 2.0 * p->sigma - 1.0) * spring_power(clip(fabs(u), 0.0, 1.0), p->n);
    double inside = clip(x, law->x_min, law->x_max);
    double amplifier_slope = x == inside ? polynomial(law->dFA, slope_count(p->amplifier), inside) : 0.0;
    double hysteretic = omega * amplifier_slope + polynomial(p->kA, p->amplifier, inside) * p->rho * slope;
    return elastic_slope(law, inside) + p->kappa_omega * hysteretic;
}

/* ---- work.py ---------------------------------------------------------------------------------------------------- */

/* Points are taken four at a time. */
enum { MOST_GROUPS = 5, NODES = MOST_GROUPS * (MOST_GROUPS + 1) };

/* The positive nodes of Gauss-Legendre's rules on [-1, 1] of 4, 8, ... 20 points, and their weights. */
static const double NODE[NODES] = {
    0.33998104358485626, 0.86113631159405258, 0.1834346424956498, 0.52553240991632899, 0.79666647741362674,
    0.96028985649753623, 0.12523340851146892, 0.36783149899818019, 0.58731795428661745, 0.76990267419430469,
    0.90411725637047486, 0.98156063424671925, 0.09501250983763744, 0.28160355077925891, 0.45801677765722739,
    0.61787624440264375, 0.75540440835500303, 0.86563120238783174, 0.94457502307323258, 0.98940093499164993,
    0.076526521133497334, 0.22778585114164508, 0.37370608871541956, 0.5108670019508271, 0.63605368072651503,
    0.74633190646015079, 0.83911697182221882, 0.91223442825132591, 0.96397192727791379, 0.99312859918509492,
};
static const double WEIGHT[NODES] = {
    0.65214515486254614, 0.34785484513745386, 0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
    0.10122853629037626, 0.24914704581340279, 0.23349253653835481, 0.20316742672306592, 0.16007832854334623,
    0.10693932599531843, 0.047175336386511827, 0.1894506104550685, 0.18260341504492359, 0.16915651939500254,
    0.14959598881657673, 0.12462897125553387, 0.095158511682492785, 0.062253523938647893, 0.027152459411754095,
    0.15275338713072585, 0.14917298647260375, 0.14209610931838205, 0.13168863844917663, 0.11819453196151842,
    0.10193011981724044, 0.083276741576704749, 0.062672048334109064, 0.040601429800386941, 0.017614007139152118,
};
/* Where a part is so short, of a block's half width, and FA so smooth on it, 4 points and 8 points are enough; 12 and
 * 16 where FA is smooth. */
static const double SHORT_4 = 0.06, ROUGH_4 = 1.0, SHORT_8 = 0.4, ROUGH_8 = 16.0, ROUGH_12 = 48.0, ROUGH_16 = 160.0;

/* Two numbers, in one register where there are such: not all compilers find that out, nor at all settings. a*x + b is
 * rounded twice in either form. */
#if defined(__GNUC__) && (defined(__SSE2__) || defined(__aarch64__))
#define PAIR_REGISTERS
#define POLYNOMIAL inline
typedef double Pair __attribute__((vector_size(2 * sizeof(double))));
#define PAIR(first, second) ((Pair){first, second})
#define OF_PAIR(pair, which) ((pair)[which])
#define TIMES_PLUS(a, x, b) ((a) * (x) + (b))
#else
#define POLYNOMIAL SPRING_NOINLINE
typedef struct {
    double of[2];
} Pair;
#define PAIR(first, second) ((Pair){{first, second}})
#define OF_PAIR(pair, which) ((pair).of[which])
#define TIMES_PLUS(a, x, b) PAIR((a).of[0] * (x).of[0] + (b).of[0], (a).of[1] * (x).of[1] + (b).of[1])
#endif

static inline Pair twice(double value)
{
    return PAIR(value, value);
}

static inline Pair pair_of(const double *values)
{
    return PAIR(values[0], values[1]);
}

static inline Pair times_plus(Pair a, Pair x, Pair b)
{
    return TIMES_PLUS(a, x, b);
}

static inline Pair times(Pair a, Pair x)
{
    return times_plus(a, x, twice(0.0));
}

/* The polynomial of an even number of coefficients: of its even and of its odd part, since operations that wait for
 * each other are what takes time. */
static POLYNOMIAL Pair polynomial_at(const double *coefficients, int count, Pair x)
{
    Pair x_2 = times(x, x), even = twice(coefficients[count - 2]), odd = twice(coefficients[count - 1]);
    for (int i = count - 4; i >= 0; i -= 2) {
        even = times_plus(even, x_2, twice(coefficients[i]));
        odd = times_plus(odd, x_2, twice(coefficients[i + 1]));
    }
    return times_plus(odd, x, even);
}

#ifdef PAIR_REGISTERS
/* The same at two pairs. */
static inline void polynomials_at(const double *coefficients, int count, Pair x, Pair y, Pair *at_x, Pair *at_y)
{
    Pair x_2 = times(x, x), y_2 = times(y, y), c = twice(coefficients[count - 2]);
    Pair even_x = c, even_y = c, odd_x = twice(coefficients[count - 1]), odd_y = odd_x;
    for (int i = count - 4; i >= 0; i -= 2) {
        c = twice(coefficients[i]);
        even_x = times_plus(even_x, x_2, c);
        even_y = times_plus(even_y, y_2, c);
        c = twice(coefficients[i + 1]);
        odd_x = times_plus(odd_x, x_2, c);
        odd_y = times_plus(odd_y, y_2, c);
    }
    *at_x = times_plus(odd_x, x, even_x);
    *at_y = times_plus(odd_y, y, even_y);
}
#endif

static inline int padded(int count)
{
    return count + count % 2;
}

/* Work of FE within the range, from the offset. */
static double elastic_work_inside(const SpringLaw *law, double x)
{
    int i = spline_piece(&law->spline, law->parameters.knots, x);
    return spline_work(&law->spline, i, x - law->spline.knots[i]);
}

/* Of FE outside, as if its slope stayed what it is at the end. */
static double elastic_work_outside(const SpringLaw *law, double out)
{
    return out * (law->FE_outside[out > 0.0] + 0.5 * law->FE_slope_outside[out > 0.0] * out);
}

/* Work of FE between two displacements. */
SPRING_NOINLINE static double elastic_work(const SpringLaw *law, double before, double now)
{
    const SpringParameters *p = &law->parameters;
    before -= p->displacement_offset;
    now -= p->displacement_offset;
    double from = clip(before, law->x_min, law->x_max), to = clip(now, law->x_min, law->x_max), work;
    if (p->knots == 0) {
        Pair both = polynomial_at(law->FE_work, p->elastic + 1 + (p->elastic + 1) % 2, PAIR(from, to));
        work = OF_PAIR(both, 1) - OF_PAIR(both, 0);
    } else {
        work = elastic_work_inside(law, to) - elastic_work_inside(law, from);
    }
    return work + (elastic_work_outside(law, now - to) - elastic_work_outside(law, before - from));
}

/* What a stroke has still to do from xi to high, and the part of it that comes next, on one branch of W and on one side
 * of each end of the range, where x = x_at_zero + per_z*|xi|. FA is constant outside. */
typedef struct {
    const SpringLaw *law;
    const SpringBlocks *blocks;
    double xi, high, done;
    double enters, leaves; /* xi at the ends of the range */
    double x_at_zero, per_z;
    double constant; /* FA, if its degree is 0 */
    int degree, falls;
    int block; /* that holds xi */
} Part;

/* The block that holds z, counted without branches, which would often be mispredicted. */
SPRING_NOINLINE static int block_of(const SpringBlocks *blocks, double z)
{
    const double *ends = blocks->ends + 1;
    int below = 0, within = 0;
    for (int k = 1; k < SPRING_BLOCKS / 8; k++)
        below += ends[8 * k - 1] <= z;
    ends += 8 * (size_t)below;
    for (int k = 0; k < 8; k++)
        within += ends[k] <= z;
    return 8 * below + within;
}

/* How many groups of points are exact for a product of that many coefficients, or as many as it needs; see SHORT_4. */
static inline int groups_for(int coefficients, double length, double rough)
{
    int exact = (coefficients + 7) / 8, groups = 3 + (rough >= ROUGH_12) + 2 * (rough >= ROUGH_16);
    groups -= (length < SHORT_8) & (rough < ROUGH_8);
    groups -= (length < SHORT_4) & (rough < ROUGH_4);
    return groups < exact ? groups : exact;
}

/* Integral of |W|*FA over |xi| from a to b, both on one block, or beyond the last, where |W| = 1. */
SPRING_NOINLINE static double cut_work(const Part *part, int block, double a, double b)
{
    const SpringBlocks *blocks = part->blocks;
    double half = 0.5 * (b - a), middle = a + half;
    double x = part->x_at_zero + part->per_z * middle, reach = part->per_z * half;
    double theta = (middle - blocks->middle[block]) * blocks->per_half[block], length = half * blocks->per_half[block];
    double rough = 2.0 * half * part->law->roughness, total = 0.0;
    int saturated = block == blocks->count;
    /* 2 groups for |W| alone; else exact for the degree of the product, or as many as it needs. */
    int64_t groups = 2;
    if (saturated && part->degree == 0)
        return (b - a) * part->constant;
    if (part->degree > 0)
        groups = groups_for(part->degree + (saturated ? 1 : SPRING_BLOCK_POWERS), length, rough);
    const double *node = NODE + groups * (groups - 1), *weight = WEIGHT + groups * (groups - 1);
    const double *W = blocks->coefficients[saturated ? 0 : block], *FA = part->law->FA;
    int count = padded(part->degree + 1);
#ifdef PAIR_REGISTERS
    for (int i = 0; i < 2 * groups; i += 2) {
        Pair s = pair_of(node + i), left = twice(1.0), right = left;
        if (!saturated)
            polynomials_at(W, SPRING_BLOCK_POWERS, times_plus(s, twice(-length), twice(theta)),
                           times_plus(s, twice(length), twice(theta)), &left, &right);
        if (part->degree > 0) {
            Pair FA_left, FA_right;
            polynomials_at(FA, count, times_plus(s, twice(-reach), twice(x)), times_plus(s, twice(reach), twice(x)),
                           &FA_left, &FA_right);
            left = times(left, FA_left);
            right = times(right, FA_right);
        }
        for (int k = 0; k < 2; k++)
            total += weight[i + k] * (OF_PAIR(left, k) + OF_PAIR(right, k));
    }
#else
    /* The same in the same order, with fewer registers. */
    for (int i = 0; i < 2 * groups; i++) {
        Pair value = twice(1.0);
        if (!saturated)
            value = polynomial_at(W, SPRING_BLOCK_POWERS, PAIR(theta - node[i] * length, theta + node[i] * length));
        if (part->degree > 0)
            value = times(value, polynomial_at(FA, count, PAIR(x - node[i] * reach, x + node[i] * reach)));
        total += weight[i] * (OF_PAIR(value, 0) + OF_PAIR(value, 1));
    }
#endif
    return half * (part->degree > 0 ? total : total * part->constant);
}

/* The same over whole blocks: over the first ones together, over runs, and over others one by one, two at a time. */
SPRING_NOINLINE static double whole_work(const Part *part, int from, int to)
{
    const SpringLaw *law = part->law;
    const SpringBlocks *blocks = part->blocks;
    if (part->degree == 0)
        return (blocks->area[to] - blocks->area[from]) * part->constant;
    double total = 0.0;
    int count = padded(part->degree + 1), grows = part->per_z > 0.0, core = law->core[part->falls];
    if (from == 0 && 0 < core && core <= to) {
        double x = part->x_at_zero + part->per_z * (0.5 * blocks->ends[core]);
        Pair work = polynomial_at(law->core_work[part->falls][grows], count, twice(x));
        total = OF_PAIR(work, 0);
        from = core;
    }
    while (from < to) {
        int each = from % SPRING_RUN != 0 || to - from < SPRING_RUN, aligned = from - from % SPRING_RUN + SPRING_RUN;
        int end = !each ? to - to % SPRING_RUN : aligned < to ? aligned : to, step = each ? 1 : SPRING_RUN;
        int first = from / step, last = end / step;
        const double *middle = each ? blocks->middle : blocks->run_middle;
        const double(*work)[SPRING_PADDED][2] =
            each ? law->block_work[part->falls][grows] : law->run_work[part->falls][grows];
        for (int64_t pair = first / 2; 2 * pair < last; pair++) {
            const double(*c)[2] = work[pair];
            Pair x = times_plus(pair_of(middle + 2 * pair), twice(part->per_z), twice(part->x_at_zero));
            Pair x_2 = times(x, x);
            Pair even = pair_of(c[count - 2]), odd = pair_of(c[count - 1]);
            for (int m = count - 4; m >= 0; m -= 2) {
                even = times_plus(even, x_2, pair_of(c[m]));
                odd = times_plus(odd, x_2, pair_of(c[m + 1]));
            }
            even = times_plus(odd, x, even);
            total += 2 * pair >= first ? OF_PAIR(even, 0) : 0.0;
            total += 2 * pair + 1 < last ? OF_PAIR(even, 1) : 0.0;
        }
        from = end;
    }
    return total;
}

/* Goes on to the branch of W on which xi grows from here. */
static void enter_branch(Part *part, double per_xi)
{
    part->falls = part->xi < 0.0;
    part->blocks = part->falls ? &part->law->table->falling.blocks : &part->law->table->rising.blocks;
    part->per_z = part->falls ? -per_xi : per_xi;
    part->block = part->xi == 0.0 ? 0 : block_of(part->blocks, fabs(part->xi));
}

SPRING_NOINLINE static void begin_work(Part *part, const SpringMemory *memory)
{
    const SpringLaw *law = part->law;
    double offset = law->parameters.displacement_offset, rho = law->parameters.rho, per_xi = memory->direction / rho;
    double start = memory->start - offset;
    part->xi = memory->start_xi + rho * fabs((memory->energy_at - offset) - start);
    part->high = memory->start_xi + rho * fabs((memory->displacement - offset) - start);
    part->done = 0.0;
    part->x_at_zero = start - memory->direction * memory->start_xi / rho;
    int grows = memory->direction > 0;
    part->enters = memory->direction * rho * ((grows ? law->x_min : law->x_max) - part->x_at_zero);
    part->leaves = memory->direction * rho * ((grows ? law->x_max : law->x_min) - part->x_at_zero);
    enter_branch(part, per_xi);
}

/* Where the next part ends: the integrand changes where the stroke crosses an end of the range, and at xi = 0. */
static double end_of_part(const Part *part)
{
    double end = part->xi < 0.0 && 0.0 < part->high ? 0.0 : part->high;
    if (part->xi < part->enters && part->enters < end)
        end = part->enters;
    return part->xi < part->leaves && part->leaves < end ? part->leaves : end;
}

/* Integral of omega*FA dx times rho over the next part. */
SPRING_NOINLINE static void work_on(Part *part)
{
    const SpringLaw *law = part->law;
    const double *ends = part->blocks->ends;
    double end = end_of_part(part), a = fabs(part->falls ? end : part->xi), b = fabs(part->falls ? part->xi : end);
    double middle = part->x_at_zero + 0.5 * part->per_z * (a + b);
    int outside = middle < law->x_min || middle > law->x_max;
    part->degree = outside ? 0 : law->parameters.amplifier - 1;
    part->constant = outside ? law->FA_outside[middle > law->x_max] : law->FA[0];
    part->xi = end;
    int from = part->block, to = end == 0.0 ? 0 : block_of(part->blocks, fabs(end));
    part->block = to;
    if (part->falls) {
        to = from;
        from = part->block;
    }
    double total = cut_work(part, to, from < to ? ends[to] : a, b);
    if (from < to && a > ends[from]) {
        total += cut_work(part, from, a, ends[from + 1]);
        from++;
    }
    if (from < to)
        total += whole_work(part, from, to);
    part->done += part->falls ? -total : total;
    if (end == 0.0)
        enter_branch(part, part->falls ? -part->per_z : part->per_z);
}

/* ---- stepper.py ------------------------------------------------------------------------------------------------- */

SpringMemory spring_start(double displacement, double omega)
{
    return (SpringMemory){
        .displacement = displacement, .omega = omega, .start = displacement, .energy_at = displacement};
}

SPRING_NOINLINE static double energy_now(const SpringLaw *law, const SpringMemory *memory)
{
    if (memory->energy_at == memory->displacement || !law->has_energy)
        return memory->energy;
    Part part;
    part.law = law;
    begin_work(&part, memory);
    while (part.xi < part.high)
        work_on(&part);
    double hysteretic = law->parameters.kappa_omega / law->parameters.rho * part.done;
    return memory->energy + elastic_work(law, memory->energy_at, memory->displacement) + hysteretic;
}

double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory)
{
    return energy_now(law, memory);
}

/* Integrates the energy up to now. */
static inline void integrate_energy(const SpringLaw *law, SpringMemory *memory)
{
    memory->energy = energy_now(law, memory);
    memory->energy_at = memory->displacement;
}

void spring_integrate(const SpringLaw *law, SpringMemory *memory)
{
    integrate_energy(law, memory);
}

/* A new stroke, which goes in the other direction; the energy is integrated up to here. */
static void reverse(const SpringLaw *law, SpringMemory *memory, int direction)
{
    memory->start_xi = spring_inverse(law->table, direction * memory->omega);
    memory->start = memory->displacement;
    memory->direction = direction;
}

static void continue_stroke(const SpringLaw *law, SpringMemory *memory, double displacement)
{
    double xi = memory->start_xi + law->parameters.rho * fabs(displacement - memory->start);
    memory->displacement = displacement;
    memory->omega = memory->direction * spring_saturation(law->table, xi);
}

SpringMemory spring_trial(const SpringLaw *law, const SpringMemory *memory, double displacement)
{
    SpringMemory after = *memory;
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return after;
    int direction = travel > 0.0 ? 1 : -1;
    if (direction != memory->direction) {
        integrate_energy(law, &after);
        reverse(law, &after, direction);
    }
    continue_stroke(law, &after, displacement);
    return after;
}

/* ---- derivatives ------------------------------------------------------------------------------------------------ */

/* Derivatives of omega where the path ends. */
static SpringSensitivity omega_derivatives(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    int direction = memory->direction;
    if (direction == 0)
        return (SpringSensitivity){.by_omega_start = 1.0};
    double length = fabs(memory->displacement - memory->start);
    SpringSlopes at = spring_slopes(law->table, memory->start_xi + law->parameters.rho * length);
    return (SpringSensitivity){
        .by_rho = direction * at.slope * (sensitivity->by_rho + length),
        .by_sigma = direction * (at.slope * sensitivity->by_sigma + at.by_sigma),
        .by_n = direction * (at.slope * sensitivity->by_n + at.by_n),
        .by_omega_start = direction * at.slope * sensitivity->by_omega_start,
    };
}

/* The sensitivity at the beginning of a stroke, from the derivatives of omega there. */
static SpringSensitivity inherited(const SpringLaw *law, const SpringMemory *stroke, const SpringSensitivity *change)
{
    int direction = stroke->direction;
    SpringSlopes at = spring_slopes(law->table, stroke->start_xi);
    double slope = clip(at.slope, 1e-12, INFINITY);
    return (SpringSensitivity){
        .by_rho = direction * change->by_rho / slope,
        .by_sigma = (direction * change->by_sigma - at.by_sigma) / slope,
        .by_n = (direction * change->by_n - at.by_n) / slope,
        .by_omega_start = direction * change->by_omega_start / slope,
    };
}

SpringSensitivity spring_trial_sensitivity(
    const SpringLaw *law, const SpringMemory *before, const SpringSensitivity *sensitivity, const SpringMemory *after)
{
    if (after->direction == before->direction)
        return *sensitivity;
    SpringSensitivity change = omega_derivatives(law, before, sensitivity);
    return inherited(law, after, &change);
}

void spring_change(
    const SpringLaw *before, const SpringLaw *after, SpringMemory *memory, SpringSensitivity *sensitivity)
{
    const SpringParameters *old = &before->parameters, *new = &after->parameters;
    spring_integrate(before, memory);
    if (memory->direction == 0 || (old->rho == new->rho && old->sigma == new->sigma && old->n == new->n))
        return;
    SpringSensitivity change = {0};
    if (sensitivity != NULL)
        change = omega_derivatives(before, memory, sensitivity);
    if (old->rho != new->rho)
        change.by_rho = 0.0;
    if (old->sigma != new->sigma)
        change.by_sigma = 0.0;
    if (old->n != new->n)
        change.by_n = 0.0;
    memory->start = memory->displacement;
    memory->start_xi = spring_inverse(after->table, memory->direction * memory->omega);
    if (sensitivity != NULL)
        *sensitivity = inherited(after, memory, &change);
}

/* A new stroke, and what it inherits. */
SPRING_NOINLINE static void reverse_sensitivity(
    const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, int direction)
{
    SpringSensitivity change = omega_derivatives(law, memory, sensitivity);
    reverse(law, memory, direction);
    *sensitivity = inherited(law, memory, &change);
}

void spring_commit(const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement)
{
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return;
    int direction = travel > 0.0 ? 1 : -1;
    if (direction != memory->direction) {
        /* Before the sensitivity, so that the frames of both do not add up. */
        integrate_energy(law, memory);
        if (sensitivity != NULL)
            reverse_sensitivity(law, memory, sensitivity, direction);
        else
            reverse(law, memory, direction);
    }
    continue_stroke(law, memory, displacement);
}

/* x^i and its derivatives. */
static void powers(double x, double value[SPRING_COEFFICIENTS], double slope[SPRING_COEFFICIENTS])
{
    value[0] = 1.0;
    slope[0] = 0.0;
    for (int i = 1; i < SPRING_COEFFICIENTS; i++) {
        value[i] = value[i - 1] * x;
        slope[i] = i * value[i - 1];
    }
}

/* The slope of FE's slope within the range. */
static double elastic_bend(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0) {
        double ddFE[SPRING_COEFFICIENTS];
        return polynomial(ddFE, derivative(law->dFE, slope_count(p->elastic), ddFE), x);
    }
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_bend(&law->spline, i, x - law->spline.knots[i]);
}

/* An output depends on x = displacement - offset, and on x held between min - offset and max - offset, `inside`. A
 * table of FE stays where its knots are when the offset moves: of_table is its part of the two derivatives. */
static void place(SpringGradient *gradient, int side, double by_x, double by_inside, double of_table)
{
    gradient->by_place = by_x + (side == 0 ? by_inside : 0.0);
    gradient->by_displacement_offset = of_table - (by_x + by_inside);
    gradient->by_displacement_min = side < 0 ? by_inside : 0.0;
    gradient->by_displacement_max = side > 0 ? by_inside : 0.0;
}

SpringOmegaSlope spring_omega_slope(const SpringLaw *law, const SpringMemory *memory)
{
    const double rho = law->parameters.rho, n = law->parameters.n;
    /* Paper eq. (22): the slope is rho*(1 + factor*|u|^n). */
    int direction = memory->direction ? memory->direction : 1;
    double u = direction * memory->omega, size = clip(fabs(u), DBL_EPSILON, 1.0);
    double factor = u >= 0.0 ? -1.0 : 2.0 * law->parameters.sigma - 1.0;
    double power = spring_power(clip(fabs(u), 0.0, 1.0), n);
    double value = 1.0 + factor * power;
    return (SpringOmegaSlope){
        .value = rho * value,
        .by_omega = fabs(u) > 1.0
                        ? 0.0
                        : rho * (u >= 0.0 ? direction : -direction) * factor * n * spring_power(size, n) / size,
        .by_rho = value,
        .by_sigma = u >= 0.0 ? 0.0 : 2.0 * rho * power,
        .by_n = rho * factor * power * spring_logarithm(size),
    };
}

void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness)
{
    const SpringParameters *p = &law->parameters;
    const double kappa = p->kappa_omega, omega = memory->omega;
    double x = memory->displacement - p->displacement_offset;
    double inside = clip(x, law->x_min, law->x_max), out = x - inside;
    int side = x < law->x_min ? -1 : x > law->x_max ? 1 : 0;
    double within = side == 0 ? 1.0 : 0.0;
    SpringOmegaSlope slope = spring_omega_slope(law, memory);
    SpringSensitivity change = {.by_omega_start = 1.0};
    if (sensitivity != NULL)
        change = omega_derivatives(law, memory, sensitivity);

    double ddFA[SPRING_COEFFICIENTS];
    int hysteretic = slope_count(p->amplifier), hysteretics = derivative(law->dFA, hysteretic, ddFA);
    double FE_1 = elastic_slope(law, inside), FE_2 = elastic_bend(law, inside);
    double FA = polynomial(p->kA, p->amplifier, inside);
    double FA_1 = polynomial(law->dFA, hysteretic, inside), FA_2 = polynomial(ddFA, hysteretics, inside);

    double value[SPRING_COEFFICIENTS], first[SPRING_COEFFICIENTS];
    memset(of_force, 0, sizeof *of_force);
    memset(of_stiffness, 0, sizeof *of_stiffness);
    powers(inside, value, first);
    for (int i = 0; i < p->elastic; i++) {
        of_force->by_kE[i] = value[i] + first[i] * out;
        of_stiffness->by_kE[i] = first[i];
    }
    if (p->knots) {
        spring_spline_gradient(
            &law->spline, p->knots, inside, 1.0, out, of_force->by_FE_forces, of_force->by_FE_knots);
        spring_spline_gradient(
            &law->spline, p->knots, inside, 0.0, 1.0, of_stiffness->by_FE_forces, of_stiffness->by_FE_knots);
    }
    for (int i = 0; i < p->amplifier; i++) {
        of_force->by_kA[i] = kappa * omega * value[i];
        of_stiffness->by_kA[i] = kappa * (omega * first[i] * within + value[i] * slope.value);
    }

    of_force->by_displacement = spring_stiffness(law, memory);
    of_force->by_kappa_omega = omega * FA;
    of_force->by_rho = kappa * FA * change.by_rho;
    of_force->by_sigma = kappa * FA * change.by_sigma;
    of_force->by_n = kappa * FA * change.by_n;
    of_force->by_omega_start = kappa * FA * change.by_omega_start;
    place(of_force, side, FE_1, FE_2 * out + kappa * omega * FA_1, p->knots ? FE_1 + FE_2 * out : 0.0);

    double by_omega = kappa * (FA_1 * within + FA * slope.by_omega), by_slope = kappa * FA;
    double by_inside = FE_2 + kappa * (omega * FA_2 * within + FA_1 * slope.value);
    of_stiffness->by_displacement = by_inside * within + by_omega * slope.value;
    of_stiffness->by_kappa_omega = omega * FA_1 * within + FA * slope.value;
    of_stiffness->by_rho = by_omega * change.by_rho + by_slope * slope.by_rho;
    of_stiffness->by_sigma = by_omega * change.by_sigma + by_slope * slope.by_sigma;
    of_stiffness->by_n = by_omega * change.by_n + by_slope * slope.by_n;
    of_stiffness->by_omega_start = by_omega * change.by_omega_start;
    place(of_stiffness, side, 0.0, by_inside, p->knots ? FE_2 : 0.0);
}
