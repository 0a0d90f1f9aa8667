/* BSDF `@NAME@`: a surface that reflects evenly into all directions (Lambert).
 *
 *   "materials": {"wall": {"plugin": "@NAME@", "params": {"albedo": [0.8, 0.4, 0.2]}}}
 *
 * `closure` resolves everything local at a point (textures, if there were any) into a closure, whose bytes the host keeps; `eval` and
 * `sample` are then called with those bytes. Directions point away from the surface, in the shading frame: z is the normal, and both
 * sides have the same material here. A value carries no cosine, a sample's `forward` is the density of its direction per
 * steradian, and its weight is value * |cos| / density. */
#include "resolvent.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979f

/* An instance, and the bytes of its closures. */
typedef struct {
  float albedo[3];
} even;

static resolvent_status eval(const void *data, const resolvent_float3 *wo, const resolvent_float3 *wi, uint32_t mode,
                             resolvent_scatter_eval *out) {
  const even *self = data;
  (void)mode;
  memset(out, 0, sizeof *out);
  /* On different sides: nothing passes. */
  if (!(wo->v[2] * wi->v[2] > 0.0f)) return RESOLVENT_STATUS_OK;
  for (int i = 0; i < 3; i++) out->f.lane[i] = self->albedo[i] / PI;
  out->forward = fabsf(wi->v[2]) / PI;
  out->reverse = fabsf(wo->v[2]) / PI;
  return RESOLVENT_STATUS_OK;
}

static resolvent_status sample(const void *data, const resolvent_float3 *wo, const resolvent_scatter_draws *u, uint32_t mode,
                               resolvent_scatter_sample *out) {
  const even *self = data;
  (void)mode;
  if (wo->v[2] == 0.0f) return RESOLVENT_STATUS_NONE;
  /* Uniform on the disk below the hemisphere: the density is cos/pi, and the weight the albedo. */
  float r = sqrtf(u->dir[0]), z = sqrtf(1.0f - u->dir[0]), turn = 2.0f * PI * u->dir[1];
  memset(out, 0, sizeof *out);
  out->wi.v[0] = r * cosf(turn);
  out->wi.v[1] = r * sinf(turn);
  out->wi.v[2] = copysignf(z, wo->v[2]);
  for (int i = 0; i < 3; i++) out->weight.lane[i] = self->albedo[i];
  out->eta = 1.0f;
  out->forward = z / PI;
  out->reverse = fabsf(wo->v[2]) / PI;
  out->measure = RESOLVENT_MEASURE_SOLID_ANGLE;
  return RESOLVENT_STATUS_OK;
}

static uint32_t lobes(const void *data) {
  (void)data;
  return RESOLVENT_LOBES_SMOOTH;
}

static const resolvent_scatter_table scatter = {sizeof(resolvent_scatter_table), sizeof(even), eval, sample, lobes, NULL};

/* The host has checked the values against the declarations and filled in defaults; a spectrum always arrives as three numbers. */
static void *create(const resolvent_create_args *args) {
  even *self = calloc(1, sizeof *self);
  for (uint32_t i = 0; self && i < args->param_count; i++) {
    const resolvent_param *p = &args->params[i];
    if (p->name.len == 6 && memcmp(p->name.data, "albedo", 6) == 0 && p->count == 3)
      for (int k = 0; k < 3; k++) self->albedo[k] = (float)p->numbers[k];
  }
  return self;
}

static void destroy(void *instance) { free(instance); }

static uint32_t traits(const void *instance) {
  (void)instance;
  return RESOLVENT_BSDF_TRAITS_UNIFORM;
}

static resolvent_status closure(const void *instance, const resolvent_surface_point *at, resolvent_closure *out) {
  (void)at;
  out->table = &scatter;
  memcpy(out->data, instance, sizeof(even));
  return RESOLVENT_STATUS_OK;
}

static const resolvent_bsdf_table table = {sizeof(resolvent_bsdf_table), 0, create, destroy, traits, closure, NULL};

/* Name, unit, help, default, choices; smallest, largest, kind, flags. */
static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("albedo"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("share that is reflected"), RESOLVENT_TEXT("0.8"),
     RESOLVENT_TEXT(""), 0.0, 1.0, RESOLVENT_PARAM_KIND_SPECTRUM, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
};

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_BSDF,
    RESOLVENT_TEXT("@NAME@"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("A surface that reflects evenly into all directions."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
