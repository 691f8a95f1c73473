// The project's BRDF in GLSL: isotropic Cook-Torrance with GGX, as svbrdf.renderer has it.
// D's denominator is written with the sine between normal and half vector, which single precision needs
// for sharp highlights.

export const BRDF = /* glsl */ `
const float PI = 3.14159265358979;
const float COSINE_FLOOR = 0.001;
const float ROUGHNESS_FLOOR = 0.03;

float clampedCosine(vec3 a, vec3 b) {
  return clamp(dot(a, b), COSINE_FLOOR, 1.0);
}

vec3 brdf(vec3 normal, vec3 toLight, vec3 toView, vec3 diffuse, float roughness, vec3 specular) {
  vec3 halfway = normalize(toLight + toView);
  float nl = clampedCosine(normal, toLight);
  float nv = clampedCosine(normal, toView);
  float vh = clampedCosine(toView, halfway);
  float nh = clampedCosine(normal, halfway);
  vec3 across = cross(normal, halfway);
  float sine2 = dot(normal, halfway) > COSINE_FLOOR ? dot(across, across) : 1.0 - nh * nh;
  float rough = clamp(roughness, ROUGHNESS_FLOOR, 1.0);
  float alpha = rough * rough;
  float ratio = alpha / (sine2 + nh * nh * alpha * alpha);
  float distribution = ratio * ratio / PI;
  vec3 fresnel = specular + (1.0 - specular) * exp2((-5.55473 * vh - 6.98316) * vh);
  float k = alpha / 2.0;
  float visibility = 1.0 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
  return diffuse * (1.0 - specular) / PI + fresnel * (distribution * visibility / 4.0);
}

vec3 shade(
  vec3 normal, vec3 toLight, vec3 toView, vec3 diffuse, float roughness, vec3 specular,
  vec3 irradiance
) {
  vec3 f = brdf(normal, toLight, toView, diffuse, roughness, specular);
  return f * clamp(dot(normal, toLight), 0.0, 1.0) * irradiance;
}
`;
