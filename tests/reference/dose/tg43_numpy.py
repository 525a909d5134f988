"""TG-43U1 (Rivard et al., Med. Phys. 31, 2004, 633-674, equation 1) in numpy, for scripts that judge doses: quick, and
apart from the program. tg43_check.py has it once more, slower and to 1e-9, from the protocol's text alone."""
import tomllib

import numpy as np


class Source:
    """TG-43U1 of a file of config/sources, in numpy."""

    def __init__(self, file):
        t = tomllib.loads(file.read_text())
        self.L, self.Lambda, self.half_life = t["active_length_cm"], t["dose_rate_constant"], t["half_life_days"]
        self.gr, self.g = np.array(t["g"]["r_cm"]), np.array(t["g"]["values"])
        self.Fr, self.Ft, self.F = (np.array(t["F"][k], float) for k in ("r_cm", "theta_deg", "values"))
        for row in self.F:
            for j in range(len(row) - 2, -1, -1):
                if np.isnan(row[j]):
                    row[j] = row[j + 1]

    def geometry(self, y, z):
        return (np.arctan2(z + self.L / 2, y) - np.arctan2(z - self.L / 2, y)) / (self.L * y)

    def rate(self, p_mm, centre, axis):
        """cGy/h/U at points (n × 3)."""
        d = (p_mm - centre) / 10
        z = d @ axis
        y = np.maximum(np.linalg.norm(d - z[:, None] * axis, axis=1), 1e-6)
        r = np.hypot(z, y)
        theta = np.degrees(np.arctan2(y, z))
        if self.Ft[-1] == 90:
            theta = np.minimum(theta, 180 - theta)
        j = np.clip(np.searchsorted(self.Fr, r) - 1, 0, len(self.Fr) - 2)
        i = np.clip(np.searchsorted(self.Ft, theta) - 1, 0, len(self.Ft) - 2)
        u = np.clip((r - self.Fr[j]) / (self.Fr[j + 1] - self.Fr[j]), 0, 1)
        v = np.clip((theta - self.Ft[i]) / (self.Ft[i + 1] - self.Ft[i]), 0, 1)
        F = ((1 - v) * ((1 - u) * self.F[i, j] + u * self.F[i, j + 1])
             + v * ((1 - u) * self.F[i + 1, j] + u * self.F[i + 1, j + 1]))
        g = np.exp(np.interp(r, self.gr, np.log(self.g)))
        return self.Lambda * self.geometry(y, z) / self.geometry(np.array([1.0]), np.array([0.0])) * g * F
