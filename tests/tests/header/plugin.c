/* Names every table and the macros, in what both C and C++ understand. */
#include "resolvent.h"

static void *create(const resolvent_create_args *args) {
  resolvent_text why = RESOLVENT_TEXT("as asked");
  if (args->param_count > 1000) args->host->fail(args->host->ctx, why);
  return (void *)args;
}

static void destroy(void *instance) { (void)instance; }

static resolvent_status closure(const void *instance, const resolvent_medium_point *at, resolvent_closure *out) {
  (void)instance;
  (void)at;
  out->table = NULL;
  return RESOLVENT_STATUS_OK;
}

static const resolvent_phase_table table = {sizeof(resolvent_phase_table), 0, create, destroy, closure};

static const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("a"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("nothing"), RESOLVENT_TEXT("0"), RESOLVENT_TEXT(""), -1.0, 1.0,
     RESOLVENT_PARAM_KIND_FLOAT, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX}};

RESOLVENT_EXPORT resolvent_plugin = {RESOLVENT_MAGIC,
                                     RESOLVENT_ABI_MAJOR,
                                     RESOLVENT_ABI_MINOR,
                                     sizeof(resolvent_header),
                                     RESOLVENT_PLUGIN_KIND_PHASE,
                                     RESOLVENT_TEXT("nothing"),
                                     RESOLVENT_TEXT("1.0.0"),
                                     RESOLVENT_TEXT("Does nothing."),
                                     params,
                                     sizeof params / sizeof *params,
                                     sizeof *params,
                                     &table};

void uses(const resolvent_host *host, const resolvent_scene_table *scene, const resolvent_output_table *out,
          const resolvent_medium_table *medium, const resolvent_bsdf_table *bsdf, const resolvent_integrator_table *integrator);

void uses(const resolvent_host *host, const resolvent_scene_table *scene, const resolvent_output_table *out,
          const resolvent_medium_table *medium, const resolvent_bsdf_table *bsdf, const resolvent_integrator_table *integrator) {
  resolvent_float2 uv = {{0.0f, 1.0f}};
  resolvent_float4 texel;
  resolvent_pixel_sample sample = {{{0.0f}}, 1.0f, 0.0f, {{0.0f}}, {{0.0f}}};
  resolvent_spectrum sigma;
  host->texture(host->ctx, NULL, &uv, &texel);
  if (scene->traits & RESOLVENT_SCENE_TRAITS_MEDIA) (void)out->add(out->ctx, 0, 0, &sample);
  (void)medium->depth(NULL, NULL, &sigma);
  (void)bsdf->traits(NULL);
  (void)integrator->render(NULL, scene, NULL, out);
}
