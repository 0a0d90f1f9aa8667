/* A test of the plugin; `resolvent plugin check` has more. */
#include "@NAME@.c"
#include <assert.h>
#include <stdio.h>

/* Samples say what `eval` says of them. */
int main(void) {
  even self = {{0.9f, 0.5f, 0.1f}};
  resolvent_float3 wo = {{0.0f, 0.8f, -0.6f}};
  for (int i = 0; i < 100; i++) {
    resolvent_scatter_draws u = {0.5f, {(float)i / 100.0f, (float)(i * 37 % 100) / 100.0f}};
    resolvent_scatter_sample s;
    resolvent_scatter_eval e;
    assert(sample(&self, &wo, &u, RESOLVENT_MODE_RADIANCE, &s) == RESOLVENT_STATUS_OK);
    assert(eval(&self, &wo, &s.wi, RESOLVENT_MODE_RADIANCE, &e) == RESOLVENT_STATUS_OK);
    assert(fabsf(s.forward - e.forward) < 1e-6f && fabsf(s.reverse - e.reverse) < 1e-6f);
    for (int k = 0; k < 3; k++) assert(fabsf(s.weight.lane[k] * s.forward - e.f.lane[k] * fabsf(s.wi.v[2])) < 1e-6f);
  }
  printf("ok: samples agree with eval\n");
  return 0;
}
