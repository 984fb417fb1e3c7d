/* Small numerical pieces that several files share. */
#ifndef NUMERICS_H
#define NUMERICS_H

enum { GAUSS_POINTS = 8 };

/* Gauss-Legendre nodes and weights on [-1, 1], exact for degree 15. */
static const double GAUSS_8[GAUSS_POINTS][2] = {
    {-0.18343464249564980, 0.36268378337836198}, {0.18343464249564980, 0.36268378337836198},
    {-0.52553240991632899, 0.31370664587788729}, {0.52553240991632899, 0.31370664587788729},
    {-0.79666647741362674, 0.22238103445337447}, {0.79666647741362674, 0.22238103445337447},
    {-0.96028985649753623, 0.10122853629037626}, {0.96028985649753623, 0.10122853629037626}};

static inline double polynomial(const double *coefficients, int count, double x)
{
    double total = coefficients[count - 1];
    for (int i = count - 2; i >= 0; i--)
        total = total * x + coefficients[i];
    return total;
}

/* The number of coefficients of a polynomial's derivative. */
static inline int slope_count(int count)
{
    return count > 1 ? count - 1 : 1;
}

/* The derivative's coefficients, which may take the place of the polynomial's; returns their number. */
static inline int derivative(const double *coefficients, int count, double *of)
{
    of[0] = 0.0;
    for (int i = 1; i < count; i++)
        of[i - 1] = i * coefficients[i];
    return slope_count(count);
}

static inline double clip(double value, double low, double high)
{
    value = low > value ? low : value;
    return high < value ? high : value;
}

#endif
