/* Integrator `@NAME@`: ambient occlusion, the share of the sky that is seen from what the camera sees.
 *
 *   "integrator": {"plugin": "@NAME@", "params": {"distance": 2}}
 *
 * The host divides the picture into pieces of work; `render` adds every sample of every pixel of one of them. The scene answers in
 * vertices and edges: `emerge` follows the camera's ray to the first vertex, `propagate` goes on from there. What a sample is must
 * depend on seed, pixel and number of the sample alone: all random numbers come from a stream that has these as its key. A call of
 * the scene that returns less than 0 has failed: return its status at once. */
#include "resolvent.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979f

/* An instance. */
typedef struct {
  float distance;
} occlusion;

/* SplitMix64 (Steele et al. 2014). */
static uint64_t bits(uint64_t *state) {
  uint64_t z = *state += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/* Uniform in [0, 1). */
static float uniform(uint64_t *state) { return (float)(bits(state) >> 40) * (1.0f / 16777216.0f); }

static resolvent_float2 uniform2(uint64_t *state) {
  resolvent_float2 u;
  u.v[0] = uniform(state);
  u.v[1] = uniform(state);
  return u;
}

/* The random numbers of a flight through media. */
static resolvent_flight_draws flight(const resolvent_scene_table *scene, uint64_t *state) {
  resolvent_flight_draws u = {bits(state), uniform(state), uniform(state), 0, scene->lanes, 0, 0, {{1, 1, 1, 1}}};
  u.hero = (uint32_t)(bits(state) % scene->lanes);
  return u;
}

/* A direction from a surface, distributed like the cosine, on the side it is seen from; any from a medium. */
static resolvent_float3 direction(const resolvent_vertex *v, resolvent_float2 u) {
  float turn = 2.0f * PI * u.v[1], z = 1.0f - 2.0f * u.v[0];
  if (v->kind == RESOLVENT_VERTEX_KIND_MEDIUM) {
    float r = sqrtf(fmaxf(0.0f, 1.0f - z * z));
    resolvent_float3 any = {{r * cosf(turn), r * sinf(turn), z}};
    return any;
  }
  const float *s = v->frame.s.v, *t = v->frame.t.v, *n = v->frame.n.v;
  float side = v->wo.v[0] * n[0] + v->wo.v[1] * n[1] + v->wo.v[2] * n[2];
  float r = sqrtf(u.v[0]), x = r * cosf(turn), y = r * sinf(turn);
  z = copysignf(sqrtf(1.0f - u.v[0]), side);
  resolvent_float3 wi;
  for (int i = 0; i < 3; i++) wi.v[i] = x * s[i] + y * t[i] + z * n[i];
  return wi;
}

/* One sample of a pixel. */
static resolvent_status trace(const occlusion *self, const resolvent_scene_table *scene, resolvent_uint2 pixel, uint64_t *state,
                              resolvent_pixel_sample *out) {
  memset(out, 0, sizeof *out);
  resolvent_float2 film = uniform2(state), lens = uniform2(state);
  resolvent_camera_ray ray;
  resolvent_status status = scene->camera_ray(scene->ctx, &pixel, &film, &lens, &ray);
  if (status != RESOLVENT_STATUS_OK) return status < 0 ? status : RESOLVENT_STATUS_OK;
  resolvent_vertex seen, beyond;
  resolvent_edge edge;
  resolvent_flight_draws u = flight(scene, state);
  status = scene->emerge(scene->ctx, &ray, &u, &edge, &seen);
  if (status < 0) return status;
  int open = status == RESOLVENT_STATUS_NONE || seen.kind == RESOLVENT_VERTEX_KIND_EMITTER;
  if (!open) {
    resolvent_float3 wi = direction(&seen, uniform2(state));
    u = flight(scene, state);
    memset(&edge, 0, sizeof edge);
    edge.length = INFINITY;
    status = scene->propagate(scene->ctx, &seen, &wi, &u, &edge, &beyond);
    if (status < 0) return status;
    open = edge.length > self->distance;
    out->alpha = 1.0f;
  }
  for (int i = 0; i < 3; i++) out->radiance.lane[i] = open ? ray.weight : 0.0f;
  return RESOLVENT_STATUS_OK;
}

static resolvent_status render(const void *instance, const resolvent_scene_table *scene, const resolvent_tile *tile,
                               const resolvent_output_table *out) {
  for (uint32_t y = tile->min[1]; y < tile->max[1]; y++) {
    for (uint32_t x = tile->min[0]; x < tile->max[0]; x++) {
      for (uint32_t i = tile->sample_begin; i < tile->sample_end; i++) {
        resolvent_uint2 pixel = {{x, y}};
        resolvent_pixel_sample sample;
        uint64_t state = tile->seed;
        state = bits(&state) ^ ((uint64_t)y << 32 | x);
        state = bits(&state) ^ i;
        resolvent_status status = trace(instance, scene, pixel, &state, &sample);
        if (status == RESOLVENT_STATUS_OK) status = out->add(out->ctx, x, y, &sample);
        if (status != RESOLVENT_STATUS_OK) return status;
      }
    }
  }
  return RESOLVENT_STATUS_OK;
}

static void *create(const resolvent_create_args *args) {
  occlusion *self = calloc(1, sizeof *self);
  for (uint32_t i = 0; self && i < args->param_count; i++)
    if (args->params[i].count == 1) self->distance = (float)args->params[i].numbers[0];
  return self;
}

static void destroy(void *instance) { free(instance); }

static const resolvent_integrator_table table = {sizeof(resolvent_integrator_table), 0, create, destroy, render};

/* Name, unit, help, default, choices; smallest, largest, kind, flags. */
static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("distance"), RESOLVENT_TEXT("length"), RESOLVENT_TEXT("what is farther away hides nothing"), RESOLVENT_TEXT("1"),
     RESOLVENT_TEXT(""), 0.0, 0.0, RESOLVENT_PARAM_KIND_FLOAT, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_ABOVE_MIN},
};

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_INTEGRATOR,
    RESOLVENT_TEXT("@NAME@"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("Ambient occlusion: the share of the sky that is seen."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
