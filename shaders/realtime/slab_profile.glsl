// SPDX-License-Identifier: GPL-3.0-or-later
// Light that comes through a medium of isotropic scattering from a surface on its other side. Through a slab of thickness h, lit evenly
// from behind, what leaves along the normal is
//     T(h) = w e^(-r h / l) + (1 - w) e^(-q h / l)
// with the mean free path l, and w, r and q of the color that a half-space of the medium reflects: a fit to the integral equation of
// radiative transfer (scripts/fit/slab.py), which random walks solve. It holds the light that nothing scattered, B(h) = e^(-h / (m l)).
// Points of the other side count by their distance s and by the cosines, a to the normal where light leaves and b to that where it
// enters, of the way between:
//     (sqrt(a b) (X / s - X') + a^(n - 1) b (n B / s - B')) / (2 pi s),    X = T - B
// On the plane that is lit of a slab a = b = h / s, so that the integral is T(h) for every thickness; on one plane a = b = 0.
// Include geometry.glsl before it.

#define BEAM_COSINE 0.988 // m, of the walks that Cycles begins (addon/closures/subsurface_fit.py)
#define BEAM_EXPONENT 8.0 // n; of a beam as narrow as Cycles' it would be 80, which few points would meet

struct SlabProfile {
    vec3 share; // w
    vec3 slow;  // r / l, and so on [1/m]
    vec3 fast;
    vec3 beam;
};

// color: 0 to 1, clamped, NaN gives 0; mean_free_path above 0 [m].
SlabProfile slab_profile(vec3 color, vec3 mean_free_path)
{
    vec3 a = diffuse_albedo(color);
    vec3 share = 1.35649 + a * (0.86395 + a * (-8.32902 + a * (15.05464 + a * (-14.12518 + a * 5.47091))));
    vec3 slow = 1.04344 + a * (-0.57838 + a * (-4.28033 + a * (9.40402 + a * (-8.60006 + a * 3.07965))));
    vec3 fast = 1.15106 + a * (2.14374 + a * (-6.08417 + a * 3.34274));
    return SlabProfile(share, slow / mean_free_path, fast / mean_free_path, 1.0 / (BEAM_COSINE * mean_free_path));
}

// Returns the weight of a point [1/m^2] at the distance s above 0 [m]; cosine, lit_cosine: a and b, 0 to 1.
vec3 slab_density(SlabProfile profile, float s, float cosine, float lit_cosine)
{
    vec3 slow = profile.share * exp(-profile.slow * s), fast = (1.0 - profile.share) * exp(-profile.fast * s);
    vec3 beam = exp(-profile.beam * s);
    vec3 scattered = (slow + fast - beam) / s + profile.slow * slow + profile.fast * fast - profile.beam * beam;
    vec3 straight = beam * (BEAM_EXPONENT / s + profile.beam);
    float wide = sqrt(cosine * lit_cosine), narrow = pow(cosine, BEAM_EXPONENT - 1.0) * lit_cosine;
    return (wide * max(scattered, 0.0) + narrow * straight) / (6.28318530717959 * s);
}
