/* BSDF `oren-nayar`: rough matt surfaces such as clay, plaster and moon dust, which look flatter than Lambert's.
 *
 *   "materials": {"clay": {"plugin": "oren-nayar", "params": {"albedo": [0.7, 0.45, 0.35], "roughness": 0.8}}}
 *
 * Oren and Nayar's model (1994) in the form of Fujii (2012), which never reflects more than `albedo`:
 *
 *   f = albedo (A + B s/t),   A = 1/(pi + (pi/2 - 2/3) r),   B = r A,   r = `roughness`,
 *   s = wo.wi - cos cos',     t = max(cos, cos') if s > 0, else 1
 *
 * Directions are sampled with the density cos/pi. */
#include "resolvent.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979f

/* An instance, and the bytes of its closures. */
typedef struct {
  float albedo[3];
  float a, b;
} oren_nayar;

/* f over the albedo, for directions on the same side. */
static float shape(const oren_nayar *self, const resolvent_float3 *wo, const resolvent_float3 *wi) {
  float co = fabsf(wo->v[2]), ci = fabsf(wi->v[2]);
  float s = wo->v[0] * wi->v[0] + wo->v[1] * wi->v[1];
  return self->a + self->b * (s > 0.0f ? s / fmaxf(fmaxf(co, ci), 1e-7f) : s);
}

static resolvent_status eval(const void *data, const resolvent_float3 *wo, const resolvent_float3 *wi, uint32_t mode,
                             resolvent_scatter_eval *out) {
  const oren_nayar *self = data;
  (void)mode;
  memset(out, 0, sizeof *out);
  if (!(wo->v[2] * wi->v[2] > 0.0f)) return RESOLVENT_STATUS_OK;
  float f = fmaxf(0.0f, shape(self, wo, wi));
  for (int i = 0; i < 3; i++) out->f.lane[i] = self->albedo[i] * f;
  out->forward = fabsf(wi->v[2]) / PI;
  out->reverse = fabsf(wo->v[2]) / PI;
  return RESOLVENT_STATUS_OK;
}

static resolvent_status sample(const void *data, const resolvent_float3 *wo, const resolvent_scatter_draws *u, uint32_t mode,
                               resolvent_scatter_sample *out) {
  const oren_nayar *self = data;
  (void)mode;
  if (wo->v[2] == 0.0f) return RESOLVENT_STATUS_NONE;
  float r = sqrtf(u->dir[0]), z = sqrtf(1.0f - u->dir[0]), turn = 2.0f * PI * u->dir[1];
  memset(out, 0, sizeof *out);
  out->wi.v[0] = r * cosf(turn);
  out->wi.v[1] = r * sinf(turn);
  out->wi.v[2] = copysignf(z, wo->v[2]);
  /* f cos / (cos/pi). */
  float f = fmaxf(0.0f, shape(self, wo, &out->wi)) * PI;
  for (int i = 0; i < 3; i++) out->weight.lane[i] = self->albedo[i] * f;
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

static const resolvent_scatter_table scatter = {sizeof(resolvent_scatter_table), sizeof(oren_nayar), eval, sample, lobes, NULL};

static int is(resolvent_text name, const char *other) {
  return name.len == strlen(other) && memcmp(name.data, other, name.len) == 0;
}

static void *create(const resolvent_create_args *args) {
  oren_nayar *self = calloc(1, sizeof *self);
  float roughness = 0.0f;
  for (uint32_t i = 0; self && i < args->param_count; i++) {
    const resolvent_param *p = &args->params[i];
    if (is(p->name, "albedo") && p->count == 3)
      for (int k = 0; k < 3; k++) self->albedo[k] = (float)p->numbers[k];
    if (is(p->name, "roughness") && p->count == 1) roughness = (float)p->numbers[0];
  }
  if (self) {
    self->a = 1.0f / (PI + (0.5f * PI - 2.0f / 3.0f) * roughness);
    self->b = roughness * self->a;
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
  memcpy(out->data, instance, sizeof(oren_nayar));
  return RESOLVENT_STATUS_OK;
}

static const resolvent_bsdf_table table = {sizeof(resolvent_bsdf_table), 0, create, destroy, traits, closure, NULL};

/* Name, unit, help, default, choices; smallest, largest, kind, flags. */
static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("albedo"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("share that is reflected"), RESOLVENT_TEXT("0.8"),
     RESOLVENT_TEXT(""), 0.0, 1.0, RESOLVENT_PARAM_KIND_SPECTRUM, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
    {RESOLVENT_TEXT("roughness"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("from smooth, which is Lambert's, to rough"),
     RESOLVENT_TEXT("0.5"), RESOLVENT_TEXT(""), 0.0, 1.0, RESOLVENT_PARAM_KIND_FLOAT,
     RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
};

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_BSDF,
    RESOLVENT_TEXT("oren-nayar"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("Rough matt surfaces such as clay and plaster."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
