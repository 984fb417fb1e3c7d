#include "branches.h"

#include "saturation.h"

/* Below this, rest and mean follow from the series of ramp without cancellation. */
static const double SMALL_DECAY = 0.34;

SpringDecay spring_decay(double q)
{
    SpringDecay decay;
    if (q <= SMALL_DECAY) {
        decay.ramp = spring_exponential_tail(-q);
        decay.mean = 1.0 - q * decay.ramp;
        decay.rest = 1.0 - q * decay.mean;
    } else {
        decay.rest = spring_exponential(-q);
        decay.mean = (1.0 - decay.rest) / q;
        decay.ramp = (1.0 - decay.mean) / q;
    }
    return decay;
}
