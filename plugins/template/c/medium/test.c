/* A test of the plugin; `resolvent plugin check` has more. */
#include "@NAME@.c"
#include <assert.h>
#include <stdio.h>

/* Flights along x survive with probability exp(-sigma_t/2). */
int main(void) {
  const double identity[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  cube self = {1.5f, {1.0f, 1.0f, 1.0f}, {{0}}, {{{0}}, {{0}}}};
  assert(place(&self, identity));
  resolvent_segment s = {{{-1.0f, 0.5f, 0.5f}}, 0.0f, {{1.0f, 0.0f, 0.0f}}, 3.0f};
  uint64_t state = 1;
  const int n = 100000;
  int survived = 0;
  for (int i = 0; i < n; i++) {
    resolvent_flight_draws u = {0, uniform(&state), uniform(&state), 0, 3, 0, 0, {{1, 1, 1, 1}}};
    resolvent_flight f;
    u.key = state * 0x2545f4914f6cdd1du;
    assert(sample(&self, &s, &u, &f) == RESOLVENT_STATUS_OK && f.violations == 0);
    survived += f.event == RESOLVENT_EVENT_SURVIVED;
  }
  double mean = (double)survived / n, expected = exp(-0.75), error = sqrt(expected * (1.0 - expected) / n);
  assert(fabs(mean - expected) < 4.0 * error);
  printf("ok: transmittance %.4f, expected %.4f\n", mean, expected);
  return 0;
}
