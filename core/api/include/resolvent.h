#ifndef RESOLVENT_H
#define RESOLVENT_H

/* The plugin ABI of Resolvent, version 1.4, for plugins in C and C++.
 *
 * A plugin is a shared library that exports one object, `resolvent_plugin`, a `resolvent_header` whose `table` holds the functions of
 * its kind:
 *
 *   static const resolvent_phase_table table = {sizeof table, 0, create, destroy, closure};
 *   static const resolvent_param_decl params[] = {...};
 *   RESOLVENT_EXPORT resolvent_plugin = {
 *     RESOLVENT_MAGIC, RESOLVENT_ABI_MAJOR, RESOLVENT_ABI_MINOR, sizeof(resolvent_header),
 *     RESOLVENT_PLUGIN_KIND_PHASE, RESOLVENT_TEXT("name"), RESOLVENT_TEXT("1.0.0"), RESOLVENT_TEXT("One sentence."),
 *     params, sizeof params / sizeof *params, sizeof *params, &table};
 *
 * Rules: every table starts with its size, and later minor versions only append to it. The side that allocates frees. Every
 * function may be called from any thread at any time after `create` returned and before `destroy`. No C++ exception may leave a
 * function. Directions have unit length and point away from the vertex; BSDFs receive them in the shading frame (z is the shading
 * normal), phase functions in world coordinates. A value carries no cosine. Lengths are in scene units, coefficients in 1/length.
 *
 * Generated from the Rust crate `resolvent-api`, whose documentation has the equations and their sources. */

#include <stddef.h>
#include <stdint.h>

#define RESOLVENT_MAGIC {'R', 'E', 'S', 'O', 'L', 'V', 'N', 'T'}

/* A `resolvent_text` of a string literal. */
#define RESOLVENT_TEXT(literal) {literal, sizeof(literal) - 1}

/* Begins the definition of the exported header: RESOLVENT_EXPORT resolvent_plugin = {...}; */
#if defined(_WIN32)
#define RESOLVENT_VISIBLE __declspec(dllexport)
#elif defined(__GNUC__)
#define RESOLVENT_VISIBLE __attribute__((visibility("default")))
#else
#define RESOLVENT_VISIBLE
#endif
#ifdef __cplusplus
#define RESOLVENT_EXPORT extern "C" RESOLVENT_VISIBLE const resolvent_header resolvent_plugin; const resolvent_header
#else
#define RESOLVENT_EXPORT extern RESOLVENT_VISIBLE const resolvent_header resolvent_plugin; const resolvent_header
#endif

/* What a call came to. */
typedef int32_t resolvent_status;
/* Done. */
#define RESOLVENT_STATUS_OK 0
/* Nothing to report: no sample, no hit, absorbed. */
#define RESOLVENT_STATUS_NONE 1
/* Failed; the message went to the host's `fail`. */
#define RESOLVENT_STATUS_ERROR -1
/* The plugin panicked; the message went to the host's `fail`. */
#define RESOLVENT_STATUS_PANIC -2

/* UTF-8 text, not terminated. The pointer may be null if the length is 0. */
typedef struct resolvent_text {
  const char *data;
  size_t len;
} resolvent_text;

/* Vectors. */
typedef struct resolvent_float2 {
  float v[2];
} resolvent_float2;
typedef struct resolvent_float3 {
  float v[3];
} resolvent_float3;
typedef struct resolvent_float4 {
  float v[4];
} resolvent_float4;
typedef struct resolvent_uint2 {
  uint32_t v[2];
} resolvent_uint2;

/* Four lanes of a spectral quantity: red, green, blue and a spare one. */
typedef struct resolvent_spectrum {
  float lane[4];
} resolvent_spectrum;


/* Versions must agree exactly. */
#define RESOLVENT_ABI_MAJOR 1

/* The host accepts plugins of any minor version; it reads only what a table's size says is there. */
#define RESOLVENT_ABI_MINOR 4

/* Table is a `resolvent_medium_table`. */
#define RESOLVENT_PLUGIN_KIND_MEDIUM 1

/* Table is a `resolvent_phase_table`. */
#define RESOLVENT_PLUGIN_KIND_PHASE 2

/* Table is a `resolvent_bsdf_table`. */
#define RESOLVENT_PLUGIN_KIND_BSDF 3

/* Table is an `resolvent_integrator_table`. */
#define RESOLVENT_PLUGIN_KIND_INTEGRATOR 4

/* `true`/`false`; one number, 0 or 1. */
#define RESOLVENT_PARAM_KIND_BOOL 1

/* A whole number. */
#define RESOLVENT_PARAM_KIND_INT 2

/* A number. */
#define RESOLVENT_PARAM_KIND_FLOAT 3

/* One number for all lanes, or three (RGB); always arrives as three. */
#define RESOLVENT_PARAM_KIND_SPECTRUM 4

/* Three numbers. */
#define RESOLVENT_PARAM_KIND_VEC3 5

/* Text. */
#define RESOLVENT_PARAM_KIND_TEXT 6

/* A path; arrives absolute, resolved against the scene file. */
#define RESOLVENT_PARAM_KIND_FILE 7

/* One of the words in `choices`. */
#define RESOLVENT_PARAM_KIND_CHOICE 8

/* Any count of numbers. */
#define RESOLVENT_PARAM_KIND_NUMBERS 9

/* Another plugin, of the kind named in `choices`. */
#define RESOLVENT_PARAM_KIND_PLUGIN 10

/* Kind of a value, not of a declaration: a texture where `RESOLVENT_PARAM_FLAGS_TEXTURABLE` allows one, to be read with
 * `resolvent_host.texture`. Since minor version 1. */
#define RESOLVENT_PARAM_KIND_TEXTURE 11

/* Must be given. */
#define RESOLVENT_PARAM_FLAGS_REQUIRED 1

/* `min` applies. */
#define RESOLVENT_PARAM_FLAGS_MIN 2

/* `max` applies. */
#define RESOLVENT_PARAM_FLAGS_MAX 4

/* The value must exceed `min`. */
#define RESOLVENT_PARAM_FLAGS_ABOVE_MIN 8

/* The value must stay below `max`. */
#define RESOLVENT_PARAM_FLAGS_BELOW_MAX 16

/* It may also be a texture, whose values the host clamps to the range; for `Float` and `Spectrum` of BSDFs. Since minor
 * version 1. */
#define RESOLVENT_PARAM_FLAGS_TEXTURABLE 32

/* Has surfaces. */
#define RESOLVENT_SCENE_TRAITS_SURFACES 1

/* Has media. */
#define RESOLVENT_SCENE_TRAITS_MEDIA 2

/* The value of a flight can differ from its density: some medium's extinction differs between lanes, or all media only
 * absorb and light fades along the way. */
#define RESOLVENT_SCENE_TRAITS_CHROMATIC_MEDIA 4

/* Some medium emits. */
#define RESOLVENT_SCENE_TRAITS_EMISSIVE_MEDIA 8

/* Has lights that next-event estimation should sample. */
#define RESOLVENT_SCENE_TRAITS_LIGHTS 16

/* Has lights that a scattered ray can hit (area lights, environment, suns with an angle). */
#define RESOLVENT_SCENE_TRAITS_HITTABLE_LIGHTS 32

/* Has an environment. */
#define RESOLVENT_SCENE_TRAITS_ENVIRONMENT 64

/* Some medium's transmittances are random estimates, not in closed form. Since minor version 4. */
#define RESOLVENT_SCENE_TRAITS_TRACKED_MEDIA 128

/* Bytes a closure may occupy. Only those in use are ever written or copied by the SDK, so a small closure doesn't pay for a
 * large one; the bound leaves room for two closures of 216 bytes nested in a third (`nested`). */
#define RESOLVENT_CLOSURE_BYTES 496

/* Radiance, on walks that start at the sensor. */
#define RESOLVENT_MODE_RADIANCE 0

/* Importance, on walks that start at a light. */
#define RESOLVENT_MODE_IMPORTANCE 1

/* Per steradian. */
#define RESOLVENT_MEASURE_SOLID_ANGLE 0

/* Per area. */
#define RESOLVENT_MEASURE_AREA 1

/* Per volume. */
#define RESOLVENT_MEASURE_VOLUME 2

/* Probability of a discrete choice (delta lobes, delta lights). */
#define RESOLVENT_MEASURE_DISCRETE 3

/* Has a part with a finite density. */
#define RESOLVENT_LOBES_SMOOTH 1

/* Has a part that is a delta distribution. */
#define RESOLVENT_LOBES_DELTA 2

/* Passes light on unchanged: an index-matched boundary (transport goes through it, it is no vertex). */
#define RESOLVENT_LOBES_PASSES 4

/* `sigma_t` and `sigma_s` at a collision must be exact, not just right in their ratios: bidirectional densities
 * need it, path tracing doesn't and saves a look-up. */
#define RESOLVENT_FLIGHT_FLAGS_EXACT 1

/* No other medium reaches into the segment, so the flight won't be cut short by another's collision:
 * `resolvent_flight.emitted` may be its expectation over the whole segment. */
#define RESOLVENT_FLIGHT_FLAGS_ALONE 2

/* Reached the end of the segment. */
#define RESOLVENT_EVENT_SURVIVED 0

/* Collided at `t`. */
#define RESOLVENT_EVENT_COLLIDED 1

/* Coefficients are the same everywhere inside. */
#define RESOLVENT_MEDIUM_TRAITS_HOMOGENEOUS 1

/* Extinction is the same in all lanes (the albedo may differ). */
#define RESOLVENT_MEDIUM_TRAITS_GREY 2

/* Emits. */
#define RESOLVENT_MEDIUM_TRAITS_EMISSIVE 4

/* Flights are sampled in closed form. */
#define RESOLVENT_MEDIUM_TRAITS_ANALYTIC 8

/* Never scatters (albedo 0). */
#define RESOLVENT_MEDIUM_TRAITS_ABSORBS_ONLY 16

/* Does nothing at all: extinction and emission are zero. The host drops it. */
#define RESOLVENT_MEDIUM_TRAITS_EMPTY 32

/* Connections are estimated by survival of a free flight (`ratio` = `track`). */
#define RESOLVENT_MEDIUM_TRAITS_ANALOG_TRANSMIT 64

/* Passes all light unchanged: transport goes through it without a vertex. */
#define RESOLVENT_BSDF_TRAITS_NULL 1

/* The same at every point. */
#define RESOLVENT_BSDF_TRAITS_UNIFORM 2

/* f(wo, wi) ≠ η² f(wi, wo), on purpose: measured or artistic. Walks from lights and from the sensor see different
 * materials then, so integrators that join them disagree with those that don't. Since minor version 2. */
#define RESOLVENT_BSDF_TRAITS_NON_RECIPROCAL 4

/* Some lobes have normals of their own, made from `resolvent_surface_point.tangent`. What they carry in
 * radiance mode has the cosine of `wi` with that normal, in importance mode that of `wo`, and so
 * f(wo, wi) in one mode is η² f(wi, wo) in the other. Since minor version 3. */
#define RESOLVENT_BSDF_TRAITS_OWN_NORMALS 8

/* On the sensor. */
#define RESOLVENT_VERTEX_KIND_SENSOR 0

/* On a light that is no surface: environment, distant, point. */
#define RESOLVENT_VERTEX_KIND_EMITTER 1

/* On a surface (which may also emit). */
#define RESOLVENT_VERTEX_KIND_SURFACE 2

/* Inside a medium. */
#define RESOLVENT_VERTEX_KIND_MEDIUM 3

/* At infinity: `p` holds the direction towards it. */
#define RESOLVENT_VERTEX_FLAGS_INFINITE 1

/* On a light without extent in position or direction; scattering can't find it. */
#define RESOLVENT_VERTEX_FLAGS_DELTA 2

/* The surface emits towards `wo`. */
#define RESOLVENT_VERTEX_FLAGS_EMITS 4

/* Of a camera whose rays are parallel: densities are per area across them, not per steradian. Since minor version 2. */
#define RESOLVENT_VERTEX_FLAGS_PARALLEL 8

/* No light, no medium. */
#define RESOLVENT_NONE UINT32_MAX

/* Declaration of a parameter. */
typedef struct resolvent_param_decl {
  /* Name, as in scenes. */
  resolvent_text name;
  /* Unit, for people ("1/length"); empty if it has none. */
  resolvent_text unit;
  /* One sentence. */
  resolvent_text help;
  /* Default as JSON; empty: none, and the parameter is absent unless given. */
  resolvent_text default_;
  /* Words of a `Choice`, separated by `|`; the kind of a `Plugin`. */
  resolvent_text choices;
  /* Lower bound of every number. */
  double min;
  /* Upper bound of every number. */
  double max;
  /* A `RESOLVENT_PARAM_KIND_*` as its number. */
  uint32_t kind;
  /* Bits of `RESOLVENT_PARAM_FLAGS_*`. */
  uint32_t flags;
} resolvent_param_decl;

/* The exported symbol: plain integers first, so that a foreign or older library can be told from one of ours. */
typedef struct resolvent_header {
  /* `RESOLVENT_MAGIC`. */
  uint8_t magic[8];
  /* `RESOLVENT_ABI_MAJOR` of the side that built it. */
  uint32_t abi_major;
  /* `RESOLVENT_ABI_MINOR` of the side that built it. */
  uint32_t abi_minor;
  /* `sizeof(resolvent_header)`. */
  uint32_t size;
  /* A `RESOLVENT_PLUGIN_KIND_*` as its number. */
  uint32_t kind;
  /* Name, as in scenes. */
  resolvent_text name;
  /* Version of the plugin. */
  resolvent_text version;
  /* One sentence. */
  resolvent_text summary;
  /* Declarations of the parameters. */
  const struct resolvent_param_decl *params;
  /* How many. */
  uint32_t param_count;
  /* `sizeof(resolvent_param_decl)`. */
  uint32_t param_size;
  /* The table of the kind. */
  const void *table;
} resolvent_header;

/* The value of a parameter, checked by the host against its declaration, defaults filled in. */
typedef struct resolvent_param {
  /* Name. */
  resolvent_text name;
  /* A `RESOLVENT_PARAM_KIND_*` as its number: as declared, or `RESOLVENT_PARAM_KIND_TEXTURE`. */
  uint32_t kind;
  /* How many numbers. */
  uint32_t count;
  /* The numbers (`Bool`, `Int`, `Float`, `Spectrum`, `Vec3`, `Numbers`). */
  const double *numbers;
  /* The text (`Text`, `File`, `Choice`). */
  resolvent_text text;
  /* The nested plugin's header, or null. */
  const struct resolvent_header *header;
  /* The nested plugin's instance, or the texture; owned by the host and alive as long as this one. */
  const void *instance;
} resolvent_param;

/* A task of `resolvent_host.parallel_for`. */
typedef void (*resolvent_task)(const void *data, size_t index);

/* A right-handed orthonormal frame; `n` is the local z axis. */
typedef struct resolvent_frame {
  /* Local x axis. */
  resolvent_float3 s;
  /* Local y axis. */
  resolvent_float3 t;
  /* Local z axis. */
  resolvent_float3 n;
} resolvent_frame;

/* A point on a surface, as a BSDF sees it. */
typedef struct resolvent_surface_point {
  /* Position. */
  resolvent_float3 p;
  /* Geometric normal, unit. */
  resolvent_float3 ng;
  /* Shading frame; `n` is the shading normal, `s` follows ∂p/∂u. */
  struct resolvent_frame frame;
  /* Texture coordinates. */
  float uv[2];
  /* Lanes in use. */
  uint32_t lanes;
  /* Index of refraction of what lies on the side that `ng` points to: 1 in vacuum, the outer medium's where dielectrics are
   * nested. */
  float outside_ior;
  /* Linear colour and opacity that the mesh has here; white where it has none. Textures ask for it. Since minor version 2. */
  float color[4];
  /* Tangent space of normal maps: `n` is the shading normal before a normal map has turned it, `s` follows ∂p/∂u, and `t` is the
   * direction of growing v, so that the three are left-handed where texture coordinates are mirrored. Filled in for BSDFs with
   * the trait `RESOLVENT_BSDF_TRAITS_OWN_NORMALS` only. Since minor version 3. */
  struct resolvent_frame tangent;
} resolvent_surface_point;

/* Services of the host. */
typedef struct resolvent_host {
  /* `sizeof(resolvent_host)`. */
  uint32_t size;
  /* Minor version of the host. */
  uint32_t abi_minor;
  /* Passed back to the functions. */
  void *ctx;
  /* Says something: level 0 warning, 1 information. */
  void (*log)(void *ctx, uint32_t level, resolvent_text message);
  /* Records why the call in progress on this thread is about to return an error. */
  void (*fail)(void *ctx, resolvent_text message);
  /* Runs `task(data, i)` for all i below `count` on the host's threads and returns when all are done. */
  void (*parallel_for)(void *ctx, size_t count, resolvent_task task, const void *data);
  /* Writes red, green, blue and alpha of `texture` (the `instance` of a `resolvent_param` of the kind `RESOLVENT_PARAM_KIND_TEXTURE`) at
   * the texture coordinates `uv` to `out`: linear, clamped to the parameter's range, always finite. It takes no lock and
   * allocates nothing. Since minor version 1: there if `size` reaches it. */
  void (*texture)(void *ctx, const void *texture, const resolvent_float2 *uv, resolvent_float4 *out);
  /* The same at a point of a surface: textures may depend on more of it than its texture coordinates (the colours of its mesh),
   * which `resolvent_host.texture` takes for white. Since minor version 2: there if `size` reaches it. */
  void (*texture_at)(void *ctx,
                     const void *texture,
                     const struct resolvent_surface_point *at,
                     resolvent_float4 *out);
} resolvent_host;

/* What `create` is given. */
typedef struct resolvent_create_args {
  /* `sizeof(resolvent_create_args)`. */
  uint32_t size;
  /* How many parameters. */
  uint32_t param_count;
  /* The parameters that have a value. */
  const struct resolvent_param *params;
  /* Services; valid for the life of the process. */
  const struct resolvent_host *host;
  /* Object to world: three rows of four, column vectors. */
  double to_world[3][4];
  /* Lanes in use. */
  uint32_t lanes;
  /* Zero. */
  uint32_t reserved;
} resolvent_create_args;

/* `create`: null on failure. */
typedef void *(*resolvent_create)(const struct resolvent_create_args *args);

/* `destroy`. */
typedef void (*resolvent_destroy)(void *instance);

/* The primary samples of one scattering decision, each uniform in [0, 1). */
typedef struct resolvent_scatter_draws {
  /* Chooses a lobe. */
  float lobe;
  /* Chooses a direction within it. */
  float dir[2];
} resolvent_scatter_draws;

/* Value and densities of scattering between two given directions. */
typedef struct resolvent_scatter_eval {
  /* BSDF value for light from `wo` to `wi` (sr⁻¹, no cosine; see `RESOLVENT_MODE_*`) or phase function value (sr⁻¹, without σ_s).
   * Delta lobes contribute nothing. */
  resolvent_spectrum f;
  /* Density of sampling `wi` given `wo`, sr⁻¹. */
  float forward;
  /* Density of sampling `wo` given `wi`, sr⁻¹. */
  float reverse;
} resolvent_scatter_eval;

/* A sampled direction. */
typedef struct resolvent_scatter_sample {
  /* f · |cos θ_i| / density for a BSDF (cosine with the shading normal), f / density for a phase function. */
  resolvent_spectrum weight;
  /* The direction, unit length, in the coordinates of `wo`. */
  resolvent_float3 wi;
  /* Relative index of refraction across the event (1 if not refracted): that of the side of `wi` over that of `wo`. */
  float eta;
  /* Density of `wi` given `wo`; sr⁻¹, or a probability for `RESOLVENT_MEASURE_DISCRETE`. */
  float forward;
  /* Density of `wo` given `wi`, in the same measure. */
  float reverse;
  /* A `RESOLVENT_MEASURE_*` as its number: `SolidAngle` or `Discrete`. */
  uint32_t measure;
  /* Which lobe was chosen, for statistics. */
  uint32_t lobe;
} resolvent_scatter_sample;

/* Functions of a closure, see `Scatter`; `data` are the closure's bytes. */
typedef struct resolvent_scatter_table {
  /* `sizeof(resolvent_scatter_table)`. */
  uint32_t size;
  /* Bytes of the closure that are in use. */
  uint32_t data_size;
  /* Value and densities between two unit directions that point away from the vertex, see `Scatter::eval`. `mode` is a
   * `RESOLVENT_MODE_*` as its number. */
  resolvent_status (*eval)(const void *data,
                           const resolvent_float3 *wo,
                           const resolvent_float3 *wi,
                           uint32_t mode,
                           struct resolvent_scatter_eval *out);
  /* Chooses `wi` for `wo`, see `Scatter::sample`; `RESOLVENT_STATUS_NONE` if the light is absorbed. */
  resolvent_status (*sample)(const void *data,
                             const resolvent_float3 *wo,
                             const struct resolvent_scatter_draws *u,
                             uint32_t mode,
                             struct resolvent_scatter_sample *out);
  /* Bits of `RESOLVENT_LOBES_*`, see `Scatter::lobes`. */
  uint32_t (*lobes)(const void *data);
  /* Index of refraction below the surface over that above, see `Scatter::eta`; null: 1. */
  float (*eta)(const void *data);
} resolvent_scatter_table;

/* The data of a `Scatter` implementation together with the table of its functions. */
typedef struct resolvent_closure {
  const struct resolvent_scatter_table *table;
  /* Only as many bytes as the table says are ever written: the rest costs nothing to leave as it is. */
  uint64_t data[62];
} resolvent_closure;

/* A point in a medium, as a phase function sees it. */
typedef struct resolvent_medium_point {
  /* Position. */
  resolvent_float3 p;
  /* Lanes in use. */
  uint32_t lanes;
} resolvent_medium_point;

/* Functions of a phase function, see `PhaseFunction`. */
typedef struct resolvent_phase_table {
  /* `sizeof(resolvent_phase_table)`. */
  uint32_t size;
  /* Zero. */
  uint32_t reserved;
  /* Makes an instance. */
  resolvent_create create;
  /* Ends it. */
  resolvent_destroy destroy;
  /* Resolves the phase function at a point, see `PhaseFunction::closure`. The closure may point into the instance: no function of it is called after `destroy`. */
  resolvent_status (*closure)(const void *instance,
                              const struct resolvent_medium_point *at,
                              struct resolvent_closure *out);
} resolvent_phase_table;

/* Functions of a BSDF, see `RESOLVENT_BSDF_*`. */
typedef struct resolvent_bsdf_table {
  /* `sizeof(resolvent_bsdf_table)`. */
  uint32_t size;
  /* Zero. */
  uint32_t reserved;
  /* Makes an instance. */
  resolvent_create create;
  /* Ends it. */
  resolvent_destroy destroy;
  /* Bits of `RESOLVENT_BSDF_TRAITS_*`, see `RESOLVENT_BSDF_TRAITS`. */
  uint32_t (*traits)(const void *instance);
  /* Resolves the BSDF at a point, see `Bsdf::closure`. */
  resolvent_status (*closure)(const void *instance,
                              const struct resolvent_surface_point *at,
                              struct resolvent_closure *out);
  /* Index of refraction inside, see `Bsdf::ior`; null: 1. */
  float (*ior)(const void *instance);
} resolvent_bsdf_table;

/* An axis-aligned box; empty if any `min` exceeds its `max`. */
typedef struct resolvent_aabb {
  /* Lower corner. */
  resolvent_float3 min;
  /* Upper corner. */
  resolvent_float3 max;
} resolvent_aabb;

/* What a medium says about itself. */
typedef struct resolvent_medium_info {
  /* World bounds; outside, it is never called. */
  struct resolvent_aabb bounds;
  /* Bits of `RESOLVENT_MEDIUM_TRAITS_*`. */
  uint32_t traits;
  /* How many grids were read. */
  uint32_t grids_read;
  /* Largest extinction, 1/length. */
  resolvent_spectrum sigma_max;
  /* Memory held, bytes. */
  uint64_t memory;
  /* Bytes read from files. */
  uint64_t bytes_read;
  /* Voxels that hold a value (0 for procedural media). */
  uint64_t voxels;
} resolvent_medium_info;

/* A stretch of a straight line: the points `o + t d` with `t0 ≤ t ≤ t1`. */
typedef struct resolvent_segment {
  /* Origin. */
  resolvent_float3 o;
  /* Start, ≥ 0. */
  float t0;
  /* Direction, unit length: `t` measures world length. */
  resolvent_float3 d;
  /* End, > `t0`; may be infinite. */
  float t1;
} resolvent_segment;

/* The primary samples of one flight through a medium. */
typedef struct resolvent_flight_draws {
  /* Key of the counter-based stream that continues after `tau` and `event`. */
  uint64_t key;
  /* Uniform in [0, 1): the first exponential distance. */
  float tau;
  /* Uniform in [0, 1): the first decision. */
  float event;
  /* The lane that decides distances and events, uniform in 0..lanes (single-sample MIS over lanes). */
  uint32_t hero;
  /* Lanes in use, 1 to 4. */
  uint32_t lanes;
  /* Bits of `RESOLVENT_FLIGHT_FLAGS_*`. */
  uint32_t flags;
  /* Zero. */
  uint32_t reserved;
  /* The path's density up to here, per lane, up to a common factor: what is picked up on the way is weighted by the mean
   * of `prior · track` over lanes, so that one hero serves the whole path. All ones in grey scenes. */
  resolvent_spectrum prior;
} resolvent_flight_draws;

/* The outcome of a flight with the three densities that exact MIS on null-collision paths needs.
 * 
 * With null collisions z on the way, T_maj the majorant transmittance and lane by lane:
 * `value` = T_maj Π σ_n(z), the path's contribution; `track` = density with which free flight produces it, the
 * coefficient at its end left out; `ratio` = density with which `Medium::transmit` produces it.
 * All three share one arbitrary scale, so only their ratios mean anything and nothing underflows
 * (Miller, Georgiev & Jarosz 2019, eq. 9-15).
 * 
 * A collision at y has density `track · sigma_t(y)` per length and contributes `value · sigma_s(y)`. */
typedef struct resolvent_flight {
  /* Contribution, per lane. */
  resolvent_spectrum value;
  /* Density under free flight, per lane. */
  resolvent_spectrum track;
  /* Density under transmittance estimation, per lane. */
  resolvent_spectrum ratio;
  /* Radiance picked up on the way (W·sr⁻¹·m⁻²), already divided by its density: add it as it is. Only free flights fill it. */
  resolvent_spectrum emitted;
  /* Extinction at the collision. */
  resolvent_spectrum sigma_t;
  /* Scattering at the collision. */
  resolvent_spectrum sigma_s;
  /* Where it ended: the collision, or the segment's `t1`. */
  float t;
  /* An `RESOLVENT_EVENT_*` as its number. */
  uint32_t event;
  /* Which of the medium's phase functions scatters at the collision (0 if it has one). */
  uint32_t phase;
  /* Density look-ups made. */
  uint32_t lookups;
  /* Null collisions met. */
  uint32_t nulls;
  /* Points where the extinction exceeded the majorant (always 0 in a correct medium). */
  uint32_t violations;
} resolvent_flight;

/* Coefficients of a medium at a point. */
typedef struct resolvent_coefficients {
  /* Extinction, 1/length. */
  resolvent_spectrum sigma_t;
  /* Scattering, 1/length. */
  resolvent_spectrum sigma_s;
  /* Emitted radiance per length, W·sr⁻¹·m⁻³. */
  resolvent_spectrum emission;
} resolvent_coefficients;

/* Functions of a medium, see `RESOLVENT_MEDIUM_*`. */
typedef struct resolvent_medium_table {
  /* `sizeof(resolvent_medium_table)`. */
  uint32_t size;
  /* Zero. */
  uint32_t reserved;
  /* Makes an instance. */
  resolvent_create create;
  /* Ends it. */
  resolvent_destroy destroy;
  /* Bounds and facts, see `Medium::info`. */
  resolvent_status (*info)(const void *instance, struct resolvent_medium_info *out);
  /* Free flight: a collision or survival, with densities; see `Medium::sample`. */
  resolvent_status (*sample)(const void *instance,
                             const struct resolvent_segment *s,
                             const struct resolvent_flight_draws *u,
                             struct resolvent_flight *out);
  /* Unbiased transmittance `value/ratio` of a connection; see `Medium::transmit`. */
  resolvent_status (*transmit)(const void *instance,
                               const struct resolvent_segment *s,
                               const struct resolvent_flight_draws *u,
                               struct resolvent_flight *out);
  /* Approximate optical depth, deterministic and cheap; see `Medium::depth`. */
  resolvent_status (*depth)(const void *instance, const struct resolvent_segment *s, resolvent_spectrum *out);
  /* Exact coefficients at a point in the world, see `Medium::coefficients`. */
  resolvent_status (*coefficients)(const void *instance,
                                   const resolvent_float3 *p,
                                   struct resolvent_coefficients *out);
} resolvent_medium_table;

/* A vertex of a path. */
typedef struct resolvent_vertex {
  /* A `RESOLVENT_VERTEX_KIND_*` as its number. */
  uint32_t kind;
  /* Bits of `RESOLVENT_VERTEX_FLAGS_*`. */
  uint32_t flags;
  /* Position, or for `RESOLVENT_VERTEX_FLAGS_INFINITE` the direction towards it. */
  resolvent_float3 p;
  /* Bound of the absolute rounding error in each coordinate of `p`. */
  resolvent_float3 p_error;
  /* The light this vertex lies on, or `RESOLVENT_NONE`. */
  uint32_t light;
  /* Geometric normal (surfaces; unit). */
  resolvent_float3 ng;
  /* Which of the medium's phase functions scatters (medium vertices). */
  uint32_t phase;
  /* Unit direction towards the previous vertex. */
  resolvent_float3 wo;
  /* The medium that scatters here (medium vertices), or `RESOLVENT_NONE`. */
  uint32_t medium;
  /* Shading frame (surfaces). */
  struct resolvent_frame frame;
  /* Texture coordinates (surfaces). */
  float uv[2];
  /* Surface and primitive hit: private to the host. */
  uint32_t primitive[2];
  /* The interior media a ray leaving on the side of `wo` is in: private to the host. */
  uint64_t inside;
  /* Extinction (medium vertices). */
  resolvent_spectrum sigma_t;
  /* Scattering coefficient (medium vertices). */
  resolvent_spectrum sigma_s;
  /* Radiance emitted towards `wo`. */
  resolvent_spectrum emitted;
  /* K at this vertex. */
  struct resolvent_closure scatter;
} resolvent_vertex;

/* An edge of a path: what the media between two vertices do, see `resolvent_flight`. */
typedef struct resolvent_edge {
  /* Contribution of the media, per lane. */
  resolvent_spectrum value;
  /* Density under free flight, per lane, without the coefficient at its end. */
  resolvent_spectrum track;
  /* Density under connection, per lane. */
  resolvent_spectrum ratio;
  /* Radiance picked up on the way. */
  resolvent_spectrum emitted;
  /* Length; infinite towards vertices at infinity. */
  float length;
  /* 1 if a medium was met on the way. */
  uint32_t media;
} resolvent_edge;

/* A sampled point on a light, seen from a reference vertex. */
typedef struct resolvent_light_sample {
  /* Unit direction from the reference towards the light. */
  resolvent_float3 wi;
  /* Distance, infinite for lights at infinity. */
  float distance;
  /* Radiance towards the reference; for delta lights already divided by what would be their density
   * (intensity/distance², or the irradiance). */
  resolvent_spectrum radiance;
  /* Density of `wi` per steradian, the choice of the light included; for delta lights the probability of the choice. */
  float density;
  /* The light. */
  uint32_t light;
  /* Bits of `RESOLVENT_VERTEX_FLAGS_*`: `DELTA`, `INFINITE`. */
  uint32_t flags;
  /* Position on the light (finite lights). */
  resolvent_float3 p;
  /* Normal there (area lights). */
  resolvent_float3 ng;
  /* Surface and primitive, so that connections don't stop at the light itself: private to the host. */
  uint32_t primitive[2];
  /* Rounding error of `p`. */
  resolvent_float3 p_error;
} resolvent_light_sample;

/* A camera ray. */
typedef struct resolvent_camera_ray {
  /* Origin. */
  resolvent_float3 o;
  /* Unit direction. */
  resolvent_float3 d;
  /* Importance over density: the factor of the radiance found. */
  float weight;
  /* The interior media the camera is in: private to the host. */
  uint64_t inside;
  /* Density of the direction (sr⁻¹) under film positions of density 1 per pixel area, whatever the reconstruction filter:
   * what weights between techniques are made of. Per area across the ray, and not per steradian, if `flags` have
   * `RESOLVENT_VERTEX_FLAGS_PARALLEL`. */
  float density;
  /* Bits of `RESOLVENT_VERTEX_FLAGS_*`: `PARALLEL`. */
  uint32_t flags;
} resolvent_camera_ray;

/* A ray that leaves a light: the start of a light walk. The vertex it leaves from is filled beside it.
 * 
 * Densities: for lights with a place, `position` is per area (a probability for point lights) and `direction` per steradian;
 * for lights at infinity, `position` is that of the direction, per steradian (a probability for parallel light), and
 * `direction` that of the ray's place, per area across it. The choice of the light is part of `position`. */
typedef struct resolvent_light_ray {
  /* Origin. */
  resolvent_float3 o;
  /* Density of the vertex on the light. */
  float position;
  /* Unit direction. */
  resolvent_float3 d;
  /* Density of the ray, given that vertex. */
  float direction;
  /* Radiance (for lights of delta position: intensity; of delta direction: irradiance) times the cosine at the light,
   * over both densities. */
  resolvent_spectrum weight;
  /* The interior media the ray starts in: private to the host. */
  uint64_t inside;
} resolvent_light_ray;

/* A point on the lens as a vertex of the scene sees it. */
typedef struct resolvent_sensor_sample {
  /* What to connect to. `density` is that of `resolvent_camera_ray`, as are the `PARALLEL` bit and what it means: importance per
   * steradian at the lens, 1 per pixel area. */
  struct resolvent_light_sample target;
  /* Position on the film, pixels. */
  float film[2];
} resolvent_sensor_sample;

/* The scene as an integrator sees it. Functions return `RESOLVENT_STATUS_OK`, `RESOLVENT_STATUS_NONE` where stated, or an error, on
 * which the integrator returns at once. */
typedef struct resolvent_scene_table {
  /* `sizeof(resolvent_scene_table)`. */
  uint32_t size;
  /* Bits of `RESOLVENT_SCENE_TRAITS_*`. */
  uint32_t traits;
  /* Lanes in use. */
  uint32_t lanes;
  /* Zero. */
  uint32_t reserved;
  /* Unit direction towards the strongest distant light, or zero if there is none: what walks in media may be guided by. */
  resolvent_float3 sun;
  /* Zero. */
  uint32_t reserved_sun;
  /* Passed back to the functions. */
  const void *ctx;
  /* Ray of a sample of `pixel` (column, row). `film` are two random numbers that the reconstruction filter turns into a
   * position around the pixel's centre, `lens` two for the position on the lens. */
  resolvent_status (*camera_ray)(const void *ctx,
                                 const resolvent_uint2 *pixel,
                                 const resolvent_float2 *film,
                                 const resolvent_float2 *lens,
                                 struct resolvent_camera_ray *out);
  /* G from the sensor: as `propagate`, for a camera ray. */
  resolvent_status (*emerge)(const void *ctx,
                             const struct resolvent_camera_ray *ray,
                             const struct resolvent_flight_draws *u,
                             struct resolvent_edge *edge,
                             struct resolvent_vertex *next);
  /* G from a vertex in direction `wi`: the next vertex (surface, medium or emitter) and the edge to it.
   * `RESOLVENT_STATUS_NONE` if the light is lost; the edge's `emitted` counts even then. */
  resolvent_status (*propagate)(const void *ctx,
                                const struct resolvent_vertex *from,
                                const resolvent_float3 *wi,
                                const struct resolvent_flight_draws *u,
                                struct resolvent_edge *edge,
                                struct resolvent_vertex *next);
  /* Chooses a point on a light for `reference`. `RESOLVENT_STATUS_NONE` if there is nothing to connect to. */
  resolvent_status (*sample_light)(const void *ctx,
                                   const struct resolvent_vertex *reference,
                                   float choice,
                                   const resolvent_float2 *point,
                                   struct resolvent_light_sample *out);
  /* Density (sr⁻¹) with which `sample_light` at `reference` gives the direction to the emitting vertex `found`. */
  float (*light_density)(const void *ctx,
                         const struct resolvent_vertex *reference,
                         const struct resolvent_vertex *found);
  /* Approximate transmittance of a connection, without the test of visibility: deterministic, cheap. */
  resolvent_status (*approximate)(const void *ctx,
                                  const struct resolvent_vertex *from,
                                  const struct resolvent_light_sample *to,
                                  resolvent_spectrum *out);
  /* Reports that the scattering closure of a vertex panicked or gave a value that is not finite: the host names its plugin
   * and ends the render. */
  resolvent_status (*fault)(const void *ctx, const struct resolvent_vertex *vertex, resolvent_text message);
  /* Connects a vertex to a point on a light. `RESOLVENT_STATUS_NONE` if it is occluded. */
  resolvent_status (*connect)(const void *ctx,
                              const struct resolvent_vertex *from,
                              const struct resolvent_light_sample *to,
                              const struct resolvent_flight_draws *u,
                              struct resolvent_edge *edge);
  /* Ray through the position `film` (pixels), without the reconstruction filter. */
  resolvent_status (*film_ray)(const void *ctx,
                               const resolvent_float2 *film,
                               const resolvent_float2 *lens,
                               struct resolvent_camera_ray *out);
  /* Chooses a point on the lens for `reference`, where it can connect to. `RESOLVENT_STATUS_NONE` if it is not on the film. */
  resolvent_status (*sense)(const void *ctx,
                            const struct resolvent_vertex *reference,
                            const resolvent_float2 *lens,
                            struct resolvent_sensor_sample *out);
  /* Chooses a light, a vertex on it and a ray that leaves it. `RESOLVENT_STATUS_NONE` if there is none. */
  resolvent_status (*emit)(const void *ctx,
                           float choice,
                           const resolvent_float2 *position,
                           const resolvent_float2 *direction,
                           struct resolvent_light_ray *out,
                           struct resolvent_vertex *vertex);
  /* The two densities with which `emit` gives the vertex `light` and a ray towards `to`, as in `resolvent_light_ray`:
   * `position`, `direction`. */
  resolvent_status (*emission_density)(const void *ctx,
                                       const struct resolvent_vertex *light,
                                       const struct resolvent_vertex *to,
                                       resolvent_float2 *out);
  /* Radiance that the vertex `light`, on an emitting surface, sends towards `to`: 0 from a side that does not emit, and from
   * lights that no ray can meet. Since minor version 2: there if `size` reaches it. */
  resolvent_status (*radiance)(const void *ctx,
                               const struct resolvent_vertex *light,
                               const struct resolvent_vertex *to,
                               resolvent_spectrum *out);
} resolvent_scene_table;

/* Features of a pixel sample beyond its radiance; filled if `resolvent_tile.features` asks for them. */
typedef struct resolvent_pixel_sample {
  /* Radiance, W·sr⁻¹·m⁻². */
  resolvent_spectrum radiance;
  /* Coverage: 0 where the camera sees the environment unhindered, 1 elsewhere. */
  float alpha;
  /* Distance to the first vertex; 0 if there is none. */
  float depth;
  /* Albedo there. */
  resolvent_float3 albedo;
  /* Shading normal there (0 in media). */
  resolvent_float3 normal;
} resolvent_pixel_sample;

/* A piece of work: a rectangle of pixels and a range of samples. */
typedef struct resolvent_tile {
  /* First column and row. */
  uint32_t min[2];
  /* One past the last column and row. */
  uint32_t max[2];
  /* First sample. */
  uint32_t sample_begin;
  /* One past the last sample. */
  uint32_t sample_end;
  /* Seed of the image. */
  uint64_t seed;
  /* Width and height of the full image, pixels. */
  uint32_t resolution[2];
  /* The window that is rendered: first column and row, one past the last column and row. */
  uint32_t window[4];
  /* 1 if features are wanted. */
  uint32_t features;
  /* How far beyond the window's border light still counts for its pixels: the reach of the reconstruction filter past
   * half a pixel. */
  float margin;
} resolvent_tile;

/* Where an integrator puts its samples. */
typedef struct resolvent_output_table {
  /* `sizeof(resolvent_output_table)`. */
  uint32_t size;
  /* How many layers of light by scattering order are wanted: layer k has the light scattered k times, the last one all that was
   * scattered more often; 0: none. Since minor version 2, before which it was zero. */
  uint32_t orders;
  /* Passed back to the functions. */
  void *ctx;
  /* Adds one sample of pixel (x, y). Samples of a pixel must come in order. */
  resolvent_status (*add)(void *ctx, uint32_t x, uint32_t y, const struct resolvent_pixel_sample *sample);
  /* Adds light to the film at position `film` (pixels), for walks that start at lights: every pixel receives it times the
   * value of its reconstruction filter there, divided by the number of samples of all pixels of the window together. */
  resolvent_status (*splat)(void *ctx, const resolvent_float2 *film, const resolvent_spectrum *radiance);
  /* As `add`, with `layers`: the sample's radiance by scattering order, `orders` spectra that sum to it. Takes the place of `add`
   * if `orders` is not 0. Since minor version 2: there if `size` reaches it. */
  resolvent_status (*add_orders)(void *ctx,
                                 uint32_t x,
                                 uint32_t y,
                                 const struct resolvent_pixel_sample *sample,
                                 const resolvent_spectrum *layers);
  /* As `splat`, for light that was scattered `order` times. Takes the place of `splat` if `orders` is not 0. Since minor
   * version 2: there if `size` reaches it. */
  resolvent_status (*splat_order)(void *ctx,
                                  const resolvent_float2 *film,
                                  const resolvent_spectrum *radiance,
                                  uint32_t order);
} resolvent_output_table;

/* Functions of an integrator, see `Integrator`. */
typedef struct resolvent_integrator_table {
  /* `sizeof(resolvent_integrator_table)`. */
  uint32_t size;
  /* Zero. */
  uint32_t reserved;
  /* Makes an instance. */
  resolvent_create create;
  /* Ends it. */
  resolvent_destroy destroy;
  /* Renders a piece of work: every sample of every pixel of the tile, see `Integrator::render`. */
  resolvent_status (*render)(const void *instance,
                             const struct resolvent_scene_table *scene,
                             const struct resolvent_tile *tile,
                             const struct resolvent_output_table *out);
} resolvent_integrator_table;

#endif  /* RESOLVENT_H */
