/* Phase function `@NAME@`: scattering that grows linearly with the cosine of the angle, p(cos) = (1 + a cos) / (4 pi).
 *
 *   "phase": {"plugin": "@NAME@", "params": {"a": 1}}
 *
 * `closure` resolves everything local at a point into a closure, whose bytes the host keeps; `eval` and `sample` are then called with
 * those bytes. Both directions point away from the vertex, so the cosine of the scattering angle is -dot(wo, wi). A value integrates to
 * 1 over the sphere, a sample's `forward` is the density of its direction, and its weight is value over density. */
#include "resolvent.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FOUR_PI 12.566370614359172

/* An instance, and the bytes of its closures. */
typedef struct {
  float a;
} linear;

static float value(const linear *self, const resolvent_float3 *wo, const resolvent_float3 *wi) {
  double cosine = 0.0;
  for (int i = 0; i < 3; i++) cosine -= (double)wo->v[i] * wi->v[i];
  return (float)fmax(0.0, (1.0 + self->a * cosine) / FOUR_PI);
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
  const linear *self = data;
  double a = self->a;
  (void)mode;
  /* The distribution of the cosine is a quadratic; this form of its root needs no case for a = 0. */
  double root = sqrt(fmax(0.0, (1.0 - a) * (1.0 - a) + 4.0 * a * u->dir[0]));
  double cosine = fmin(1.0, fmax(-1.0, (4.0 * u->dir[0] - 2.0 + a) / (1.0 + root)));
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
  if (!(out->forward > 0.0f)) return RESOLVENT_STATUS_NONE;
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

static const resolvent_scatter_table scatter = {sizeof(resolvent_scatter_table), sizeof(linear), eval, sample, lobes, NULL};

/* The host has checked the values against the declarations and filled in defaults. */
static void *create(const resolvent_create_args *args) {
  linear *self = calloc(1, sizeof *self);
  for (uint32_t i = 0; self && i < args->param_count; i++) {
    const resolvent_param *p = &args->params[i];
    if (p->name.len == 1 && p->name.data[0] == 'a' && p->count == 1) self->a = (float)p->numbers[0];
  }
  return self;
}

static void destroy(void *instance) { free(instance); }

static resolvent_status closure(const void *instance, const resolvent_medium_point *at, resolvent_closure *out) {
  (void)at;
  out->table = &scatter;
  memcpy(out->data, instance, sizeof(linear));
  return RESOLVENT_STATUS_OK;
}

static const resolvent_phase_table table = {sizeof(resolvent_phase_table), 0, create, destroy, closure};

/* Name, unit, help, default, choices; smallest, largest, kind, flags. */
static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("a"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("slope; positive scatters forward"), RESOLVENT_TEXT("0.5"),
     RESOLVENT_TEXT(""), -1.0, 1.0, RESOLVENT_PARAM_KIND_FLOAT, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
};

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_PHASE,
    RESOLVENT_TEXT("@NAME@"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("Scattering that grows linearly with the cosine of the angle."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
