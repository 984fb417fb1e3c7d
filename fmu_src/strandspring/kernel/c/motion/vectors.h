/* Vectors and rotations in space. Matrices are of rows; quaternions have their real part first. */
#ifndef VECTORS_H
#define VECTORS_H

#include <math.h>
#include <string.h>

static inline double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline int is_zero3(const double *a)
{
    return a[0] == 0.0 && a[1] == 0.0 && a[2] == 0.0;
}

static inline void cross3(const double *a, const double *b, double *c)
{
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    c[0] = x;
    c[1] = y;
    c[2] = z;
}

static inline void add3(double *to, double factor, const double *a)
{
    for (int i = 0; i < 3; i++)
        to[i] += factor * a[i];
}

/* matrix*a and its transpose times a. */
static inline void turn3(const double *matrix, const double *a, double *b)
{
    double x = dot3(matrix, a), y = dot3(matrix + 3, a), z = dot3(matrix + 6, a);
    b[0] = x;
    b[1] = y;
    b[2] = z;
}

static inline void turn_back3(const double *matrix, const double *a, double *b)
{
    for (int i = 0; i < 3; i++)
        b[i] = matrix[i] * a[0] + matrix[3 + i] * a[1] + matrix[6 + i] * a[2];
}

/* The quaternion of a rotation by a vector. */
static inline void quaternion_of(const double *rotation, double *q)
{
    double square = 0.25 * dot3(rotation, rotation), sine, cosine; /* of the half angle; sine over the half angle */
    if (square < 1e-4) {
        sine = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0)));
        cosine = 1.0 - square * (1.0 / 2.0 - square * (1.0 / 24.0 - square * (1.0 / 720.0)));
    } else {
        double half = sqrt(square);
        sine = sin(half) / half;
        cosine = cos(half);
    }
    q[0] = cosine;
    for (int i = 0; i < 3; i++)
        q[1 + i] = 0.5 * sine * rotation[i];
}

static inline void quaternion_product(const double *a, const double *b, double *product)
{
    double c[3], p[4];
    cross3(a + 1, b + 1, c);
    p[0] = a[0] * b[0] - dot3(a + 1, b + 1);
    for (int i = 0; i < 3; i++)
        p[1 + i] = a[0] * b[1 + i] + b[0] * a[1 + i] + c[i];
    memcpy(product, p, sizeof p);
}

static inline double size3(const double *a)
{
    return sqrt(dot3(a, a));
}

static inline void matrix_of(const double *q, double *matrix)
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    const double rows[9] = {
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z),       2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),       1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),       2.0 * (y * z + w * x),       1.0 - 2.0 * (x * x + y * y)};
    memcpy(matrix, rows, sizeof rows);
}

/* Makes q a unit quaternion and writes its matrix. */
static inline void rotation_of(double *q, double *matrix)
{
    double length = sqrt(q[0] * q[0] + dot3(q + 1, q + 1));
    for (int i = 0; i < 4; i++)
        q[i] /= length;
    matrix_of(q, matrix);
}

/* The same of what is a unit quaternion but for rounding, by a step of Newton's method for 1/length. */
static inline void next_rotation(double *q, double *matrix)
{
    double per_length = 1.5 - 0.5 * (q[0] * q[0] + dot3(q + 1, q + 1));
    for (int i = 0; i < 4; i++)
        q[i] *= per_length;
    matrix_of(q, matrix);
}

#endif
