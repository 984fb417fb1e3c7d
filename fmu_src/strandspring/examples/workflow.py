"""The paper's whole workflow: simulated experiment, identification, prediction, FMU, and a mass on it.

python -m strandspring.examples.workflow; ``workflow.ipynb`` beside this file is the same as a notebook.
"""

# %% [markdown]
# # The workflow of Zhao et al. 2013
#
# The paper tests its method on Ni's model of a wire-rope isolator under x = X sin(t), with 3 % noise on the force
# (section 4, Table 1). Everything below runs offline in a few seconds; all quantities are in SI units.

# %%
import tempfile
from pathlib import Path

import numpy as np

import strandspring as ss

noisy = ss.synthesize("ni", seed=0)
true = ss.synthesize("ni", noise=0.0)
print(f"{len(noisy)} samples of one period, rms force {np.sqrt(np.mean(true.force**2)):.1f} N (paper: 248.2)")

# %% [markdown]
# ## Identification
#
# No method needs start values. The error is that of the paper's Table 1: against the response without noise. The first
# method is the paper's as printed; the paper gives 2.53 N, but neither X and n nor the samples of its period.

# %%
literal = ss.identify(noisy, options=ss.PaperOptions())
two_stage = ss.identify(noisy, options=ss.TwoStageOptions())
refined = ss.identify(noisy)
for name, result in (("paper", literal), ("two-stage", two_stage), ("refined", refined)):
    fit = result.spring().predict(true)
    print(f"{name:<10} RMSE {fit.rmse:.2f} N, RNL {fit.rnl:.4f}, {len(noisy)} samples a period")

# %%
print(refined.summary())

# %%
print(refined.to_frame())

# %% [markdown]
# ## Prediction of what was not measured
#
# A spring is worth something only if it follows paths that it has not seen: here loops of half the amplitude. The
# summary above warns of it: one amplitude alone says little about smaller ones.

# %%
smaller = ss.synthesize("ni", amplitudes=2.5e-3, noise=0.0)
unseen = refined.spring().predict(smaller)
print(f"half the amplitude, seen at the full one only: RNL {unseen.rnl:.3f}")
both = ss.identify([noisy, ss.synthesize("ni", amplitudes=2.5e-3, seed=1)])
print(f"half the amplitude, when it was measured too:  RNL {both.spring().predict(smaller).rnl:.3f}")

# %% [markdown]
# ## The FMU
#
# The spring becomes an FMU for any system simulator. Here FMPy moves it along a path; the force is that of the model.
# By itself it would start in the state in which the first record began.

# %%
spring = both.spring("wire_rope", "Ni's wire-rope isolator, as in Zhao et al. 2013")
path = 4e-3 * np.sin(np.linspace(0.0, 4.0 * np.pi, 401))
with tempfile.TemporaryDirectory() as folder:
    fmu = spring.build_fmu(Path(folder), zero=0.0)
    motion = ss.simulate_fmu(fmu, path, parameters={"omega_start": 0.0})
difference = np.abs(motion.force - spring.response(path)).max()
print(f"largest difference between FMU and model {difference:.1e} N, {motion.absorbed_energy[-1]:.3f} J absorbed")

# %% [markdown]
# ## A mass on it

# %%
isolation = spring.isolate(1.0, load=0.0, base_displacement=[5e-5, 2e-4], points=60)
print(isolation.summary())
