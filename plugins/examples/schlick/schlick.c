/* Phase function `schlick`: the rational stand-in for Henyey-Greenstein's (Blasi, Le Saec and Schlick 1993),
 *
 *   p(cos) = (1 - k^2) / (4 pi (1 - k cos)^2),   k about 1.55 g - 0.55 g^3
 *
 *   "phase": {"plugin": "schlick", "params": {"k": 0.7}}
 */
#include "resolvent.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FOUR_PI 12.566370614359172

/* An instance, and the bytes of its closures. */
typedef struct {
  float k;
} schlick;

static float value(const schlick *self, const resolvent_float3 *wo, const resolvent_float3 *wi) {
  double k = self->k, cosine = 0.0;
  /* Both directions point away from the vertex. */
  for (int i = 0; i < 3; i++) cosine -= (double)wo->v[i] * wi->v[i];
  double d = 1.0 - k * cosine;
  return (float)((1.0 - k * k) / (FOUR_PI * d * d));
}

static resolvent_status eval(const void *data, const resolvent_float3 *wo, const resolvent_float3 *wi, uint32_t mode,
                             resolvent_scatter_eval *out) {
  float p = value(data, wo, wi);
  (void)mode;
  for (int i = 0; i < 4; i++) out->f.lane[i] = p;
  out->forward = out->reverse = p;
  return RESOLVENT_STATUS_OK;
}

static resolvent_status sample(const void *data, const resolvent_float3 *wo, const resolvent_scatter_draws *u, uint32_t mode,
                               resolvent_scatter_sample *out) {
  const schlick *self = data;
  double k = self->k, x = u->dir[0];
  (void)mode;
  /* The distribution of the cosine, inverted. */
  double cosine = fmin(1.0, fmax(-1.0, (2.0 * x + k - 1.0) / (2.0 * k * x - k + 1.0)));
  double sine = sqrt(fmax(0.0, 1.0 - cosine * cosine)), turn = 0.5 * FOUR_PI * u->dir[1];
  /* A frame around the forward direction -wo. */
  double n[3] = {-wo->v[0], -wo->v[1], -wo->v[2]}, s[3] = {0.0, 0.0, 0.0};
  s[fabs(n[0]) < 0.5 ? 0 : 1] = 1.0;
  double along = s[0] * n[0] + s[1] * n[1] + s[2] * n[2], length = 0.0;
  for (int i = 0; i < 3; i++) s[i] -= along * n[i], length += s[i] * s[i];
  for (int i = 0; i < 3; i++) s[i] /= sqrt(length);
  double t[3] = {n[1] * s[2] - n[2] * s[1], n[2] * s[0] - n[0] * s[2], n[0] * s[1] - n[1] * s[0]};
  for (int i = 0; i < 3; i++) out->wi.v[i] = (float)(cosine * n[i] + sine * (cos(turn) * s[i] + sin(turn) * t[i]));
  /* The densities are those of the direction as it is returned. */
  out->forward = out->reverse = value(self, wo, &out->wi);
  for (int i = 0; i < 4; i++) out->weight.lane[i] = 1.0f;
  out->eta = 1.0f;
  out->measure = RESOLVENT_MEASURE_SOLID_ANGLE;
  out->lobe = 0;
  return RESOLVENT_STATUS_OK;
}

static uint32_t lobes(const void *data) {
  (void)data;
  return RESOLVENT_LOBES_SMOOTH;
}

static const resolvent_scatter_table scatter = {sizeof(resolvent_scatter_table), sizeof(schlick), eval, sample, lobes, NULL};

/* The host has checked the values against the declarations and filled in defaults. */
static void *create(const resolvent_create_args *args) {
  schlick *self = calloc(1, sizeof *self);
  for (uint32_t i = 0; self && i < args->param_count; i++) {
    const resolvent_param *p = &args->params[i];
    if (p->name.len == 1 && p->name.data[0] == 'k' && p->count == 1) self->k = (float)p->numbers[0];
  }
  return self;
}

static void destroy(void *instance) { free(instance); }

static resolvent_status closure(const void *instance, const resolvent_medium_point *at, resolvent_closure *out) {
  (void)at;
  out->table = &scatter;
  memcpy(out->data, instance, sizeof(schlick));
  return RESOLVENT_STATUS_OK;
}

static const resolvent_phase_table table = {sizeof(resolvent_phase_table), 0, create, destroy, closure};

/* Name, unit, help, default, choices; smallest, largest, kind, flags. */
static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("k"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("from backward over isotropic (0) to forward"), RESOLVENT_TEXT("0.5"),
     RESOLVENT_TEXT(""), -0.99, 0.99, RESOLVENT_PARAM_KIND_FLOAT, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
};

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_PHASE,
    RESOLVENT_TEXT("schlick"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("The rational stand-in for Henyey-Greenstein's."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
