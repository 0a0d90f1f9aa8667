/* The plugin ABI of Resolvent, version @MAJOR@.@MINOR@, for plugins in C and C++.
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
@STATUS@

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
