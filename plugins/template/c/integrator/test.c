/* A test of the plugin; `resolvent plugin check` has more. */
#include "@NAME@.c"
#include <assert.h>
#include <stdio.h>

/* Directions from a surface lie on the side it is seen from, and their mean cosine is 2/3. */
int main(void) {
  static resolvent_vertex v;
  v.kind = RESOLVENT_VERTEX_KIND_SURFACE;
  v.frame.s.v[0] = v.frame.t.v[1] = v.frame.n.v[2] = 1.0f;
  v.wo.v[2] = -1.0f;
  uint64_t state = 1;
  double sum = 0.0;
  for (int i = 0; i < 10000; i++) {
    float cosine = -direction(&v, uniform2(&state)).v[2];
    assert(cosine >= 0.0f);
    sum += cosine;
  }
  assert(fabs(sum / 1e4 - 2.0 / 3.0) < 4.0 * 0.24 / 100.0);
  printf("ok: mean cosine %.4f\n", sum / 1e4);
  return 0;
}
