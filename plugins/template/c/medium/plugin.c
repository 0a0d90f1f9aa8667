/* Medium `@NAME@`: a unit cube that gets denser along x, sigma_t(x) = `sigma_t` * x.
 *
 *   "media": {"haze": {"plugin": "@NAME@", "params": {"sigma_t": 8}}}
 *
 * `sample` is a free flight by delta tracking: possible collisions come at the rate of the majorant, and each is real with
 * probability sigma_t/majorant (Woodcock et al. 1965). The only promise to keep is that the majorant is never below the extinction:
 * one that is too small makes wrong pictures, one that is too large costs time. `transmit` lets such a flight survive or not. Where all
 * lanes have the same extinction, the three densities of a flight are 1. */
#include "resolvent.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An instance. */
typedef struct {
  float sigma_t;
  float albedo[3];
  double to_object[3][4];
  resolvent_aabb bounds;
} cube;

static resolvent_spectrum grey(float v) {
  resolvent_spectrum s = {{v, v, v, v}};
  return s;
}

static void to_object(const cube *self, const float p[3], double w, double out[3]) {
  for (int i = 0; i < 3; i++) {
    const double *row = self->to_object[i];
    out[i] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3] * w;
  }
}

/* Extinction at a point of the object. */
static float extinction(const cube *self, const double p[3]) {
  for (int i = 0; i < 3; i++)
    if (!(p[i] >= 0.0 && p[i] <= 1.0)) return 0.0f;
  return self->sigma_t * (float)p[0];
}

/* The stretch of a segment that lies in the cube, in the segment's own t. */
static int clip(const resolvent_segment *s, const double o[3], const double d[3], double *t0, double *t1) {
  *t0 = s->t0, *t1 = s->t1;
  for (int i = 0; i < 3; i++) {
    if (d[i] == 0.0) {
      if (!(o[i] >= 0.0 && o[i] <= 1.0)) return 0;
      continue;
    }
    double a = -o[i] / d[i], b = (1.0 - o[i]) / d[i];
    *t0 = fmax(*t0, fmin(a, b));
    *t1 = fmin(*t1, fmax(a, b));
  }
  return *t0 < *t1;
}

/* The stream of random numbers that a flight's key starts: SplitMix64 (Steele et al. 2014), uniform in [0, 1). */
static float uniform(uint64_t *state) {
  uint64_t z = *state += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return (float)((z ^ (z >> 31)) >> 40) * (1.0f / 16777216.0f);
}

static resolvent_status sample(const void *instance, const resolvent_segment *s, const resolvent_flight_draws *u,
                               resolvent_flight *out) {
  const cube *self = instance;
  memset(out, 0, sizeof *out);
  out->value = out->track = out->ratio = grey(1.0f);
  out->t = s->t1;
  out->event = RESOLVENT_EVENT_SURVIVED;
  double o[3], d[3], t, end;
  to_object(self, s->o.v, 1.0, o);
  to_object(self, s->d.v, 0.0, d);
  if (!clip(s, o, d, &t, &end)) return RESOLVENT_STATUS_OK;
  /* A bound for this stretch alone would be tighter, but it must not depend on where the segment ends: a flight cut short is its own
   * beginning. */
  float majorant = self->sigma_t;
  uint64_t state = u->key;
  float tau = u->tau, event = u->event;
  while (majorant > 0.0f) {
    t -= log1p(-(double)tau) / majorant;
    /* Written so that a collision is never at or behind the end of the segment, also after rounding. */
    if (!(t < end && (float)t < s->t1)) break;
    double p[3] = {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]};
    float sigma = extinction(self, p);
    out->lookups++;
    if (sigma > majorant) out->violations++;
    if (event * majorant < sigma) {
      out->t = (float)t;
      out->event = RESOLVENT_EVENT_COLLIDED;
      out->sigma_t = grey(sigma);
      for (int i = 0; i < 3; i++) out->sigma_s.lane[i] = sigma * self->albedo[i];
      break;
    }
    out->nulls++;
    tau = uniform(&state), event = uniform(&state);
  }
  return RESOLVENT_STATUS_OK;
}

static resolvent_status transmit(const void *instance, const resolvent_segment *s, const resolvent_flight_draws *u,
                                 resolvent_flight *out) {
  resolvent_status status = sample(instance, s, u, out);
  if (out->event == RESOLVENT_EVENT_COLLIDED) {
    out->value = out->track = grey(0.0f);
    out->t = s->t1;
    out->event = RESOLVENT_EVENT_SURVIVED;
  }
  return status;
}

static resolvent_status depth(const void *instance, const resolvent_segment *s, resolvent_spectrum *out) {
  const cube *self = instance;
  double o[3], d[3], t0, t1;
  to_object(self, s->o.v, 1.0, o);
  to_object(self, s->d.v, 0.0, d);
  *out = grey(0.0f);
  if (clip(s, o, d, &t0, &t1)) *out = grey(self->sigma_t * (float)((o[0] + 0.5 * (t0 + t1) * d[0]) * (t1 - t0)));
  return RESOLVENT_STATUS_OK;
}

static resolvent_status coefficients(const void *instance, const resolvent_float3 *p, resolvent_coefficients *out) {
  const cube *self = instance;
  double local[3];
  to_object(self, p->v, 1.0, local);
  float sigma = extinction(self, local);
  memset(out, 0, sizeof *out);
  out->sigma_t = grey(sigma);
  for (int i = 0; i < 3; i++) out->sigma_s.lane[i] = sigma * self->albedo[i];
  return RESOLVENT_STATUS_OK;
}

static resolvent_status info(const void *instance, resolvent_medium_info *out) {
  const cube *self = instance;
  memset(out, 0, sizeof *out);
  out->bounds = self->bounds;
  out->traits = RESOLVENT_MEDIUM_TRAITS_GREY | RESOLVENT_MEDIUM_TRAITS_ANALOG_TRANSMIT;
  if (self->sigma_t == 0.0f) out->traits |= RESOLVENT_MEDIUM_TRAITS_EMPTY;
  out->sigma_max = grey(self->sigma_t);
  out->memory = sizeof *self;
  return RESOLVENT_STATUS_OK;
}

/* Inverts the transform and finds the bounds of the transformed cube; 0 if it is flat. */
static int place(cube *self, const double m[3][4]) {
  double det = 0.0, inverse[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, e = (i + 2) % 3;
      inverse[i][j] = m[a][c] * m[b][e] - m[a][e] * m[b][c];
      if (i == 0) det += m[j][0] * inverse[0][j];
    }
  if (!(fabs(det) > 0.0 && isfinite(1.0 / det))) return 0;
  for (int i = 0; i < 3; i++) {
    self->to_object[i][3] = 0.0;
    for (int j = 0; j < 3; j++) {
      self->to_object[i][j] = inverse[i][j] / det;
      self->to_object[i][3] -= self->to_object[i][j] * m[j][3];
    }
    double low = m[i][3], high = m[i][3];
    for (int j = 0; j < 3; j++) low += fmin(0.0, m[i][j]), high += fmax(0.0, m[i][j]);
    /* Outward by the rounding to single precision. */
    self->bounds.min.v[i] = nextafterf((float)low, -INFINITY);
    self->bounds.max.v[i] = nextafterf((float)high, INFINITY);
  }
  return 1;
}

static int is(resolvent_text name, const char *other) {
  return name.len == strlen(other) && memcmp(name.data, other, name.len) == 0;
}

static void *create(const resolvent_create_args *args) {
  cube *self = calloc(1, sizeof *self);
  for (uint32_t i = 0; self && i < args->param_count; i++) {
    const resolvent_param *p = &args->params[i];
    if (is(p->name, "sigma_t") && p->count == 1) self->sigma_t = (float)p->numbers[0];
    if (is(p->name, "albedo") && p->count == 3)
      for (int k = 0; k < 3; k++) self->albedo[k] = (float)p->numbers[k];
  }
  if (self && !place(self, args->to_world)) {
    resolvent_text why = RESOLVENT_TEXT("its transform leaves no volume");
    args->host->fail(args->host->ctx, why);
    free(self);
    return NULL;
  }
  return self;
}

static void destroy(void *instance) { free(instance); }

static const resolvent_medium_table table = {
    sizeof(resolvent_medium_table), 0, create, destroy, info, sample, transmit, depth, coefficients,
};

/* Name, unit, help, default, choices; smallest, largest, kind, flags. The host gives the phase function to a flight's collisions. */
static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("sigma_t"), RESOLVENT_TEXT("1/length"), RESOLVENT_TEXT("extinction at x = 1"), RESOLVENT_TEXT("4"),
     RESOLVENT_TEXT(""), 0.0, 0.0, RESOLVENT_PARAM_KIND_FLOAT, RESOLVENT_PARAM_FLAGS_MIN},
    {RESOLVENT_TEXT("albedo"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("scattering over extinction"), RESOLVENT_TEXT("0.9"),
     RESOLVENT_TEXT(""), 0.0, 1.0, RESOLVENT_PARAM_KIND_SPECTRUM, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
    {RESOLVENT_TEXT("phase"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("phase function; isotropic unless given"), RESOLVENT_TEXT(""),
     RESOLVENT_TEXT("phase"), 0.0, 0.0, RESOLVENT_PARAM_KIND_PLUGIN, 0},
};

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_MEDIUM,
    RESOLVENT_TEXT("@NAME@"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("A unit cube that gets denser along x."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
