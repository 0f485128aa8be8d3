// Metal, written by Gonio 0.1.0 from its Python source.
//
// Rough metal with artist-friendly parameters: a color at normal incidence, and a tint at the edge (F82-tint,
// Kutz2021).
//
// f = albedo F D G / (4 (n.o)(n.i)) with F(0) = r0 and F(82 degrees) = edge times Schlick's value there, so an edge of
// 1 is Schlick's curve; at 90 degrees F = 1. It is the metal of OpenPBR, and has no index: thin films and polarization
// require a `conductor`.
//
// With ndf = beckmann, masking = smith-correlated, fresnel = f82, sampling = visible.
//
// Metal_eval(self, wo, wi)  the BSDF times |cos theta_i|, RGB, 1/sr
//
// Operations on numbers, one per component of a vector: Metal_eval 220 (184 arithmetic, 11 divisions, 4
// functions, 21 selections).
//
// wo points to the viewer, wi to the light: unit vectors of the local frame, away from the surface; +z is
// the shading normal. Colors are linear RGB. Declare `precision highp float;` above: 16-bit floats are not sufficient.

// The smallest normal float32 is 1.2e-38; its root, squared again, must not underflow in a quotient.
const float TINY = 1.0e-30;
const float GRAZING = 0.14285715;  // the cosine of about 82 degrees: the maximum of x (1 - x)^6
const float INV_PI = 0.31830987;
// Below this width the tilt of facets, about alpha, is at most a thousand roundings of a float32 direction
// (6e-8), and the peak of D, 1 / (pi alpha^2), exceeds 3e7: the lobe cannot be resolved and is replaced by
// a mirror's.
const float SMOOTH = 0.0001;

// Rough metal with artist-friendly parameters: a color at normal incidence, and a tint at the edge (F82-tint,
struct Metal {
    vec3 r0;  // reflectance at normal incidence; >= 0 and <= 1
    vec3 edge;  // factor on Schlick's curve at 82 degrees; >= 0 and <= 1
    vec2 alpha;  // width of the microfacet distribution; along x, along y; >= 0 and <= 1
    vec3 albedo;  // factor on everything reflected; >= 0 and <= 1
};

// Unit normal of the facet that mirrors wo into wi; 0 where wo = -wi, for which there is no such facet above.
vec3 half_vector(vec3 wo, vec3 wi) {
    vec3 h = wo + wi;
    float length2 = dot(h, h);
    return h * (1.0 / sqrt(max(length2, TINY)));
}

// The square of x, as one product.
float sqr(float x) {
    return x * x;
}

// R0 + (1 - R0) (1 - cos)^5 (Schlick1994; course sheet, eq. 10).
vec3 schlick(float cos_i, vec3 r0) {
    float c = max(1.0 - cos_i, 0.0);
    float c5 = sqr(sqr(c)) * c;
    return r0 + (1.0 - r0) * c5;
}

// Schlick's curve from r0 minus c x (1 - x)^6, with c such that the value at cosine 1/7 is `edge` (Kutz2021);
// clamped to >= 0, since a dark edge with a dark r0 would make it negative.
vec3 f82(float cos_i, vec3 r0, vec3 edge) {
    float x = min(max(cos_i, 0.0), 1.0);
    float square = sqr(1.0 - x);
    float dip = x * square * sqr(square) * 17.651384;
    return max(vec3(0.0), schlick(x, r0) - (schlick(GRAZING, r0) - edge) * dip);
}

// F times albedo, at a facet seen at cos_theta.
vec3 Metal_reflectance(Metal self, float cos_theta) {
    return self.albedo * f82(cos_theta, self.r0, self.edge * schlick(GRAZING, self.r0));
}

// (alpha_x w_x, alpha_y w_y, w_z), not unit.
vec3 stretch(vec3 w, vec2 alpha) {
    return vec3(alpha * w.xy, w.z);
}

// int_-inf^a (a - x) exp(-x^2) dx / sqrt(pi) = a (1 + erf a) / 2 + exp(-a^2) / (2 sqrt(pi)), for a >= 0.
//
// The integral over a Gaussian's slopes below a. In float32 a rational function, within 8e-8 of it: with erf and exp
// Beckmann's pdf took 1.8 times as long. The coefficients were fitted for Gonio by least squares of the relative error
// at 4000 Chebyshev points, reweighted toward the largest; from a = 4 on the value is a, within 2e-10.
float gaussian_ramp(float a) {
    float value = a * 0.03586975 + 0.08571726;
    value = value * a + 0.226305;
    value = value * a + 0.54497534;
    value = value * a + 1.2532219;
    value = value * a + 1.7396743;
    float value_2 = a * 0.03505152 + 0.10158618;
    value_2 = value_2 * a + 0.09772537;
    value_2 = value_2 * a + 1.1029027;
    value_2 = value_2 * a - 0.11616595;
    return a < 4.0 ? (value * a + 1.0) / (value_2 * a + 3.5449073) : a;
}

// |v.z| (1 + erf a) / 2 + sin exp(-a^2) / (2 sqrt(pi)), a = cot (Heitz2014): the slopes below a, over sin.
float Beckmann_area(vec3 v) {
    float sine = sqrt(max(sqr(v.x) + sqr(v.y), 1.0e-18));
    float a = abs(v.z) / sine;
    return sine * gaussian_ramp(a);
}

// Projected area of the facets that face v: int D(m) max(0, v.m) dm = |v.z| (1 + Lambda) (Heitz2014).
float Beckmann_projected_area(vec3 v, vec2 alpha) {
    return Beckmann_area(stretch(v, alpha));
}

// Smith's Lambda: masked over visible projected area (Heitz2014); 0 at the normal, within rounding.
float Beckmann_Lambda(vec3 v, vec2 alpha) {
    return Beckmann_projected_area(v, alpha) / max(abs(v.z), 1.0e-15) - 1.0;
}

// Masking and shadowing G, by name; 0 if wo or wi sees the facet's back side.
//
// m          the facet's normal, m.z > 0
float masking_shadowing(vec3 wo, vec3 wi, vec3 m, vec2 alpha) {
    float g = 1.0 / (1.0 + Beckmann_Lambda(wo, alpha) + Beckmann_Lambda(wi, alpha));
    bool visible = dot(wo, m) * wo.z > 0.0 && dot(wi, m) * wi.z > 0.0;
    return visible ? g : 0.0;
}

// exp(-tan^2) / (pi n_z^4).
float Beckmann_density(vec3 n) {
    float sin2 = sqr(n.x) + sqr(n.y);
    float over = 1.0 / max(sqr(n.z), 0.001 * sin2);
    return exp(-sin2 * over) * sqr(over) * INV_PI;
}

// Density of normals, 1/sr, from that of the surface of width 1.
float Beckmann_D(vec3 m, vec2 alpha) {
    float over = 1.0 / (alpha.x * alpha.y);
    vec3 n = vec3(m.xy * (alpha.yx * over), m.z);
    return m.z > 0.0 ? Beckmann_density(n) * over : 0.0;
}

// a / b, and 0 where b = 0.
float safe_div(float a, float b) {
    return b != 0.0 ? a / b : 0.0;
}

// D G / (4 |cos theta_o|): the microfacet BRDF without F, times |cos theta_i|.
float reflection(vec3 wo, vec3 wi, vec3 m, vec2 alpha) {
    float g = masking_shadowing(wo, wi, m, alpha);
    return safe_div(g * Beckmann_D(m, alpha), 4.0 * abs(wo.z));
}

// albedo F D G / (4 cos theta_o); 0 where alpha makes it a mirror.
vec3 Metal_eval(Metal self, vec3 wo, vec3 wi) {
    vec3 m = half_vector(wo, wi);
    bool is_smooth = self.alpha.x < SMOOTH && self.alpha.y < SMOOTH;
    vec2 alpha = max(self.alpha, vec2(SMOOTH));
    bool lit = wo.z > 0.0 && wi.z > 0.0 && !is_smooth;
    return Metal_reflectance(self, abs(dot(wo, m))) * (lit ? reflection(wo, wi, m, alpha) : 0.0);
}
