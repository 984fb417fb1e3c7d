#include "path.h"

#include "../../core/c/spring/resolution.h"

#include <math.h>

/* W(xi), most often on the piece where the last one was. */
static double saturation_near(const SpringTable *table, double xi, int *piece)
{
    const SpringBranch *branch = xi >= 0.0 ? &table->rising : &table->falling;
    double z = fabs(xi);
    if (*piece >= branch->pieces || !(branch->edges[*piece] <= z && z < branch->edges[*piece + 1]))
        *piece = spring_piece(branch, z);
    double value = spring_on_piece(branch, *piece, z);
    return xi >= 0.0 ? value : -value;
}

void spring_path(const SpringLaw *law, size_t count, const double *displacement, double omega_start, double *omega,
                 double *force, double *stiffness, double *energy)
{
    SpringMemory memory = spring_start(count > 0 ? displacement[0] : 0.0, omega_start);
    int piece = 0;
    for (size_t i = 0; i < count; i++) {
        if ((displacement[i] - memory.displacement) * memory.direction > 0.0) {
            double xi = memory.start_xi + law->parameters.rho * fabs(displacement[i] - memory.start);
            memory.displacement = displacement[i];
            memory.omega = memory.direction * saturation_near(law->table, xi, &piece);
        } else {
            spring_commit(law, &memory, NULL, displacement[i]);
        }
        if (omega != NULL)
            omega[i] = memory.omega;
        if (force != NULL)
            force[i] = spring_force(law, &memory);
        if (stiffness != NULL)
            stiffness[i] = spring_stiffness(law, &memory);
        if (energy != NULL) {
            spring_integrate(law, &memory);
            energy[i] = memory.energy;
        }
    }
}

void spring_force_at(const SpringLaw *law, size_t count, const double *displacement, const double *omega, double *force,
                     double *by_displacement, double *by_omega)
{
    for (size_t i = 0; i < count; i++)
        force[i] = spring_force_partials(law, displacement[i], omega[i], by_displacement + i, by_omega + i);
}

/* xi at the beginning of a stroke and its derivatives by rho, sigma, n and omega_start. */
typedef struct {
    double xi, by[4];
} Beginning;

static void begin_strokes(const SpringTable *table, double rho, double omega_start, size_t strokes,
                          const int64_t *direction, const double *length, int derivatives, Beginning *begin)
{
    double u = 0.0, change[4] = {0.0, 0.0, 0.0, 0.0};
    for (size_t k = 0; k < strokes; k++) {
        Beginning *here = &begin[k];
        if (k == 0) {
            u = (double)direction[0] * omega_start;
            change[3] = (double)direction[0];
        }
        here->xi = spring_inverse(table, u);
        double end = here->xi + rho * length[k];
        if (!derivatives) {
            u = -spring_saturation(table, end);
            continue;
        }
        SpringSlopes before = spring_slopes(table, here->xi), after = spring_slopes(table, end);
        double slope = before.slope > 1e-12 ? before.slope : 1e-12;
        const double fixed[4] = {0.0, before.by_sigma, before.by_n, 0.0};
        const double moved[4] = {after.slope * length[k], after.by_sigma, after.by_n, 0.0};
        for (int i = 0; i < 4; i++) {
            here->by[i] = (change[i] - fixed[i]) / slope;
            change[i] = -(after.slope * here->by[i] + moved[i]);
        }
        u = -after.u;
    }
}

/* omega at points of strokes that have begun, and, unless `derivatives` is NULL, its derivatives by rho, sigma, n and
 * omega_start (rows of `row`). */
static void at_points(const SpringTable *table, double rho, const Beginning *begin, const int64_t *direction,
                      size_t points, const int64_t *stroke, const double *travel, double *omega, size_t row,
                      double *derivatives)
{
    int piece = 0;
    for (size_t i = 0; i < points; i++) {
        const Beginning *at = &begin[stroke[i]];
        double side = (double)direction[stroke[i]], xi = at->xi + rho * travel[i];
        if (derivatives == NULL) {
            omega[i] = side * saturation_near(table, xi, &piece);
            continue;
        }
        SpringSlopes here = spring_slopes(table, xi);
        omega[i] = side * here.u;
        derivatives[i] = side * here.slope * (at->by[0] + travel[i]);
        derivatives[row + i] = side * (here.slope * at->by[1] + here.by_sigma);
        derivatives[2 * row + i] = side * (here.slope * at->by[2] + here.by_n);
        derivatives[3 * row + i] = side * here.slope * at->by[3];
    }
}

void spring_on_records(const SpringTable *table, size_t rates, const double *rho, const double *omega_start,
                       size_t records, const int64_t *first_stroke, const int64_t *first_point,
                       const int64_t *direction, const double *length, const int64_t *stroke, const double *travel,
                       double *workspace, double *omega, double *derivatives)
{
    Beginning *begin = (Beginning *)workspace;
    size_t points = (size_t)first_point[records];
    for (size_t rate = 0; rate < rates; rate++)
        for (size_t k = 0; k < records; k++) {
            size_t strokes = (size_t)first_stroke[k], at = (size_t)first_point[k];
            int with = derivatives != NULL && rate == rates - 1;
            begin_strokes(table, rho[rate], omega_start[k], (size_t)first_stroke[k + 1] - strokes, direction + strokes,
                          length + strokes, with, begin + strokes);
            at_points(table, rho[rate], begin, direction, (size_t)first_point[k + 1] - at, stroke + at, travel + at,
                      omega + rate * points + at, points, with ? derivatives + at : NULL);
        }
    if (derivatives == NULL)
        return;
    const double natural[3] = {rho[rates - 1], 0.5 * (1.0 + table->curvature), table->n};
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < points; i++)
            derivatives[k * points + i] *= natural[k];
}

void spring_resolved_path(size_t count, const double *displacement, double resolution, double *resolved)
{
    SpringResolver at = spring_resolver_start(count > 0 ? displacement[0] : 0.0, 0);
    for (size_t i = 0; i < count; i++)
        resolved[i] = spring_resolve(&at, displacement[i], resolution);
}
