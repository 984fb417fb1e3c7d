#include "many_paths.h"
#include "path.h"

#include <math.h>
#include <string.h>

/* Parts of the range, besides the pieces of W, over each of which Gauss's rule integrates FE of any degree to rounding. */
enum { PARTS = 4, MOST_CUTS = 2 * (SPRING_PIECES + 1) + SPRING_KNOTS + PARTS + 3 };

/* The ends of a step, and between them, in its direction, where a derivative of the force by a parameter may bend. */
typedef struct {
    int count, direction;
    double place[MOST_CUTS];
} Cuts;

static void add_cut(Cuts *cuts, double place)
{
    int at = cuts->count - 1;
    if ((place - cuts->place[0]) * cuts->direction <= 0.0 || (cuts->place[at] - place) * cuts->direction <= 0.0)
        return;
    for (; (cuts->place[at] - place) * cuts->direction > 0.0; at--)
        cuts->place[at + 1] = cuts->place[at];
    cuts->place[at + 1] = place;
    cuts->count++;
}

/* At the pieces of one branch of W from |xi| = low to high. */
static void cut_at_pieces(
    Cuts *cuts, const SpringLaw *law, const SpringMemory *stroke, const SpringBranch *branch, double low, double high)
{
    double side = branch == &law->table->rising ? 1.0 : -1.0;
    int last = spring_piece(branch, high);
    for (int k = spring_piece(branch, low); k <= last; k++) {
        double way = (side * branch->edges[k] - stroke->start_xi) / law->parameters.rho;
        add_cut(cuts, stroke->start + stroke->direction * way);
    }
}

/* Cuts a step from a displacement to the end of a stroke. */
static void cut_step(Cuts *cuts, const SpringLaw *law, const SpringMemory *stroke, double from)
{
    const SpringParameters *p = &law->parameters;
    double first = stroke->start_xi + p->rho * fabs(from - stroke->start);
    double last = stroke->start_xi + p->rho * fabs(stroke->displacement - stroke->start);
    cuts->count = 2;
    cuts->direction = stroke->direction;
    cuts->place[0] = from;
    cuts->place[1] = stroke->displacement;
    if (first < 0.0)
        cut_at_pieces(cuts, law, stroke, &law->table->falling, last < 0.0 ? -last : 0.0, -first);
    if (last > 0.0)
        cut_at_pieces(cuts, law, stroke, &law->table->rising, first > 0.0 ? first : 0.0, last);
    for (int k = 0; k <= PARTS; k++)
        add_cut(cuts, p->displacement_min + (p->displacement_max - p->displacement_min) * k / PARTS);
    for (int k = 0; k < p->knots; k++)
        add_cut(cuts, p->FE_knots[k]);
}

/* Adds the integral of the force's derivatives over the step from a displacement to where the stroke is. */
static void integrate_gradient(const SpringLaw *law, const SpringMemory *stroke, const SpringSensitivity *sensitivity,
                               double from, size_t fields, const int64_t *field, double *total)
{
    Cuts cuts;
    cut_step(&cuts, law, stroke, from);
    for (int part = 1; part < cuts.count; part++) {
        double half = 0.5 * (cuts.place[part] - cuts.place[part - 1]), middle = cuts.place[part - 1] + half;
        for (int k = 0; k < GAUSS_POINTS; k++) {
            SpringMemory at = *stroke;
            SpringGradient of_force;
            at.displacement = middle + half * GAUSS_NODES[k];
            double xi = at.start_xi + law->parameters.rho * fabs(at.displacement - at.start);
            at.omega = at.direction * spring_saturation(law->table, xi);
            spring_force_gradient(law, &at, sensitivity, &of_force);
            for (size_t i = 0; i < fields; i++)
                total[i] += half * GAUSS_WEIGHTS[k] * ((const double *)&of_force)[field[i]];
        }
    }
}

/* The derivatives along one path: rows of samples, one for each field. */
static void gradients(const SpringLaw *law, size_t samples, const double *displacement, double omega_start,
                      size_t fields, const int64_t *field, double *force_by, double *stiffness_by, double *energy_by)
{
    enum { FIELDS = sizeof(SpringGradient) / sizeof(double) };
    SpringMemory memory = spring_start(displacement[0], omega_start);
    SpringSensitivity sensitivity = {0};
    double energy[FIELDS] = {0.0};
    for (size_t k = 0; k < samples; k++) {
        double from = memory.displacement;
        SpringGradient of_force, of_stiffness;
        spring_commit(law, &memory, &sensitivity, displacement[k]);
        if (stiffness_by != NULL)
            spring_gradient(law, &memory, &sensitivity, &of_force, &of_stiffness);
        else
            spring_force_gradient(law, &memory, &sensitivity, &of_force);
        if (energy_by != NULL && memory.displacement != from)
            integrate_gradient(law, &memory, &sensitivity, from, fields, field, energy);
        for (size_t i = 0; i < fields; i++) {
            if (force_by != NULL)
                force_by[i * samples + k] = ((const double *)&of_force)[field[i]];
            if (stiffness_by != NULL)
                stiffness_by[i * samples + k] = ((const double *)&of_stiffness)[field[i]];
            if (energy_by != NULL)
                energy_by[i * samples + k] = energy[i];
        }
    }
}

static double *row(double *rows, size_t number, size_t size)
{
    return rows == NULL ? NULL : rows + number * size;
}

void spring_many_paths(size_t paths, const SpringParameters *springs, const double *omega_start, size_t samples,
                       const double *displacement, size_t apart, size_t fields, const int64_t *field,
                       SpringTable *table, int coarse, double *force, double *stiffness, double *energy,
                       double *force_by, double *stiffness_by, double *energy_by)
{
    int with = (energy != NULL ? SPRING_WITH_ENERGIES : 0) | (fields > 0 ? SPRING_WITH_DERIVATIVES : 0) |
               (coarse ? SPRING_COARSE : 0);
    for (size_t k = 0; k < paths; k++) {
        const SpringParameters *p = &springs[k];
        const double *path = displacement + k * apart;
        SpringLaw law;
        if (k == 0 || p->n != p[-1].n || p->sigma != p[-1].sigma)
            spring_tabulate(table, p->n, p->sigma, with);
        spring_prepare(&law, p, table);
        spring_path(&law, samples, path, omega_start[k], NULL, row(force, k, samples), row(stiffness, k, samples),
                    row(energy, k, samples));
        if (fields > 0)
            gradients(&law, samples, path, omega_start[k], fields, field, row(force_by, k, fields * samples),
                      row(stiffness_by, k, fields * samples), row(energy_by, k, fields * samples));
    }
}
