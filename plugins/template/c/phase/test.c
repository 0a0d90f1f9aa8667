/* A test of the plugin; `resolvent plugin check` has more. */
#include "@NAME@.c"
#include <assert.h>
#include <stdio.h>

/* The mean cosine of samples is a/3. */
int main(void) {
  linear self = {0.7f};
  resolvent_float3 wo = {{0.6f, 0.0f, 0.8f}};
  double sum = 0.0;
  const int n = 200;
  for (int i = 0; i < n; i++) {
    for (int j = 0; j < n; j++) {
      resolvent_scatter_draws u = {0.5f, {((float)i + 0.5f) / (float)n, ((float)j + 0.5f) / (float)n}};
      resolvent_scatter_sample s;
      assert(sample(&self, &wo, &u, RESOLVENT_MODE_RADIANCE, &s) == RESOLVENT_STATUS_OK);
      for (int k = 0; k < 3; k++) sum -= (double)wo.v[k] * s.wi.v[k];
    }
  }
  double mean = sum / (n * n);
  assert(fabs(mean - 0.7 / 3.0) < 1e-3);
  printf("ok: mean cosine %.4f\n", mean);
  return 0;
}
