/* Small numerical pieces that several files share. */
#ifndef NUMERICS_H
#define NUMERICS_H

enum { GAUSS_POINTS = 10 };

/* Nodes and weights of Gauss-Legendre's rule on [-1, 1], exact for degree 19. */
static const double GAUSS_NODES[GAUSS_POINTS] = {
    -0.97390652851717172, -0.86506336668898451, -0.67940956829902441, -0.43339539412924719, -0.14887433898163121,
    0.14887433898163121, 0.43339539412924719, 0.67940956829902441, 0.86506336668898451, 0.97390652851717172};
static const double GAUSS_WEIGHTS[GAUSS_POINTS] = {
    0.066671344308688138, 0.14945134915058059, 0.21908636251598204, 0.26926671930999636, 0.29552422471475287,
    0.29552422471475287, 0.26926671930999636, 0.21908636251598204, 0.14945134915058059, 0.066671344308688138};

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

/* The last of the rising values at low .. high that is <= x, or low. */
static inline int last_below(const double *values, int low, int high, double x)
{
    /* Without branches, which cannot be foreseen. */
    for (int left = high - low; left > 0; left /= 2) {
        int half = (left + 1) / 2;
        low = values[low + half] <= x ? low + half : low;
    }
    return low;
}

static inline double clip(double value, double low, double high)
{
    value = low > value ? low : value;
    return high < value ? high : value;
}

#endif
