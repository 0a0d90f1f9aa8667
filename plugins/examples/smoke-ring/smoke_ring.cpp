// Medium `smoke-ring`: a torus of smoke around the y axis, in C++.
//
//   "media": {"ring": {"plugin": "smoke-ring", "params": {"sigma_t": 20, "width": 0.2}}}
//
// The big circle has radius 1. With d the distance from it over `width`, sigma_t(x) = `sigma_t` (1 - d^2)^2 inside of the tube, so the
// extinction of the circle itself is the majorant. Flights are delta tracking within the box around the torus, connections ratio
// tracking (Novak et al. 2014, section 3.1), whose estimate is the product of 1 - sigma_t/majorant over the points met.
#include "resolvent.h"
#include <cmath>
#include <cstdint>
#include <cstring>
#include <new>
#include <optional>

namespace {

struct Vec {
  double x, y, z;
};

Vec along(const Vec &o, const Vec &d, double t) { return {o.x + t * d.x, o.y + t * d.y, o.z + t * d.z}; }

resolvent_spectrum grey(float v) { return {{v, v, v, v}}; }

// SplitMix64 (Steele et al. 2014): the stream that a flight's key starts.
class Stream {
public:
  explicit Stream(std::uint64_t key) : state(key) {}
  float uniform() {
    std::uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<float>((z ^ (z >> 31)) >> 40) * (1.0f / 16777216.0f);
  }

private:
  std::uint64_t state;
};

class Ring {
public:
  explicit Ring(const resolvent_create_args &args) {
    std::memcpy(to_world, args.to_world, sizeof to_world);
    for (std::uint32_t i = 0; i < args.param_count; i++) {
      const resolvent_param &p = args.params[i];
      const auto is = [&](const char *name) {
        return p.name.len == std::strlen(name) && std::memcmp(p.name.data, name, p.name.len) == 0;
      };
      if (is("sigma_t") && p.count == 1) sigma_t = static_cast<float>(p.numbers[0]);
      if (is("width") && p.count == 1) width = p.numbers[0];
      if (is("albedo") && p.count == 3)
        for (int k = 0; k < 3; k++) albedo[k] = static_cast<float>(p.numbers[k]);
    }
  }

  // Inverts the transform; false if it leaves no volume.
  bool place() {
    double det = 0.0, inverse[3][3];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, e = (i + 2) % 3;
        inverse[i][j] = to_world[a][c] * to_world[b][e] - to_world[a][e] * to_world[b][c];
        if (i == 0) det += to_world[j][0] * inverse[0][j];
      }
    if (!(std::fabs(det) > 0.0 && std::isfinite(1.0 / det))) return false;
    for (int i = 0; i < 3; i++) {
      to_object[i][3] = 0.0;
      for (int j = 0; j < 3; j++) {
        to_object[i][j] = inverse[i][j] / det;
        to_object[i][3] -= to_object[i][j] * to_world[j][3];
      }
    }
    return true;
  }

  resolvent_medium_info info() const {
    resolvent_medium_info out{};
    const double half[3] = {1.0 + width, width, 1.0 + width};
    for (int i = 0; i < 3; i++) {
      double reach = 0.0;
      for (int j = 0; j < 3; j++) reach += std::fabs(to_world[i][j]) * half[j];
      // Outward by the rounding to single precision.
      out.bounds.min.v[i] = std::nextafter(static_cast<float>(to_world[i][3] - reach), -INFINITY);
      out.bounds.max.v[i] = std::nextafter(static_cast<float>(to_world[i][3] + reach), INFINITY);
    }
    out.traits = RESOLVENT_MEDIUM_TRAITS_GREY;
    if (sigma_t == 0.0f) out.traits |= RESOLVENT_MEDIUM_TRAITS_EMPTY;
    out.sigma_max = grey(sigma_t);
    out.memory = sizeof *this;
    return out;
  }

  resolvent_flight sample(const resolvent_segment &s, const resolvent_flight_draws &u) const {
    resolvent_flight out = vacuum(s);
    const auto way = enter(s);
    Stream stream(u.key);
    float tau = u.tau, event = u.event;
    // The null collisions on the way, as ratio tracking would weigh them: the density of the same path under a connection.
    double ratio = 1.0;
    for (double t = way ? way->start : 0.0; way;) {
      t -= std::log1p(-static_cast<double>(tau)) / sigma_t;
      if (!(t < way->end && static_cast<float>(t) < s.t1)) break;
      const float sigma = extinction(along(way->o, way->d, t));
      out.lookups++;
      if (event * sigma_t < sigma) {
        out.t = static_cast<float>(t);
        out.event = RESOLVENT_EVENT_COLLIDED;
        out.sigma_t = grey(sigma);
        for (int i = 0; i < 3; i++) out.sigma_s.lane[i] = sigma * albedo[i];
        break;
      }
      out.nulls++;
      ratio *= sigma_t / (sigma_t - sigma);
      tau = stream.uniform(), event = stream.uniform();
    }
    // Contribution and density are both the product of the null coefficients: their quotient is 1.
    out.ratio = grey(static_cast<float>(std::fmin(ratio, 1e30)));
    return out;
  }

  resolvent_flight transmit(const resolvent_segment &s, const resolvent_flight_draws &u) const {
    resolvent_flight out = vacuum(s);
    const auto way = enter(s);
    Stream stream(u.key);
    float tau = u.tau, value = 1.0f;
    for (double t = way ? way->start : 0.0; way && value > 0.0f;) {
      t -= std::log1p(-static_cast<double>(tau)) / sigma_t;
      if (!(t < way->end)) break;
      out.lookups++;
      out.nulls++;
      value *= 1.0f - extinction(along(way->o, way->d, t)) / sigma_t;
      // The number that decides a free flight's event is drawn, too: both walk through the same points.
      tau = stream.uniform(), stream.uniform();
    }
    out.value = out.track = grey(value);
    return out;
  }

  // Mean density along the way by nine points: deterministic and cheap, which is all it is for.
  float depth(const resolvent_segment &s) const {
    const auto way = enter(s);
    if (!way || !std::isfinite(way->end)) return 0.0f;
    double sum = 0.0;
    for (int i = 0; i < 9; i++) {
      const double t = way->start + (way->end - way->start) * (i + 0.5) / 9.0;
      sum += extinction(along(way->o, way->d, t));
    }
    return static_cast<float>(sum / 9.0 * (way->end - way->start));
  }

  resolvent_coefficients coefficients(const resolvent_float3 &p) const {
    resolvent_coefficients out{};
    const float sigma = extinction(object(p, 1.0));
    out.sigma_t = grey(sigma);
    for (int i = 0; i < 3; i++) out.sigma_s.lane[i] = sigma * albedo[i];
    return out;
  }

private:
  // A ray in object space, and the part of the segment within the box around the torus.
  struct Way {
    Vec o, d;
    double start, end;
  };

  static resolvent_flight vacuum(const resolvent_segment &s) {
    resolvent_flight out{};
    out.value = out.track = out.ratio = grey(1.0f);
    out.t = s.t1;
    out.event = RESOLVENT_EVENT_SURVIVED;
    return out;
  }

  Vec object(const resolvent_float3 &p, double w) const {
    const auto row = [&](int i) {
      return to_object[i][0] * p.v[0] + to_object[i][1] * p.v[1] + to_object[i][2] * p.v[2] + to_object[i][3] * w;
    };
    return {row(0), row(1), row(2)};
  }

  float extinction(const Vec &p) const {
    const double radial = std::sqrt(p.x * p.x + p.z * p.z) - 1.0;
    const double d2 = (radial * radial + p.y * p.y) / (width * width);
    // Written so that a NaN is outside.
    return d2 < 1.0 ? sigma_t * static_cast<float>((1.0 - d2) * (1.0 - d2)) : 0.0f;
  }

  std::optional<Way> enter(const resolvent_segment &s) const {
    Way way{object(s.o, 1.0), object(s.d, 0.0), s.t0, s.t1};
    const double o[3] = {way.o.x, way.o.y, way.o.z}, d[3] = {way.d.x, way.d.y, way.d.z};
    const double half[3] = {1.0 + width, width, 1.0 + width};
    for (int i = 0; i < 3; i++) {
      if (d[i] == 0.0) {
        if (!(std::fabs(o[i]) <= half[i])) return std::nullopt;
        continue;
      }
      const double a = (-half[i] - o[i]) / d[i], b = (half[i] - o[i]) / d[i];
      way.start = std::fmax(way.start, std::fmin(a, b));
      way.end = std::fmin(way.end, std::fmax(a, b));
    }
    if (!(way.start < way.end)) return std::nullopt;
    return way;
  }

  float sigma_t = 0.0f, albedo[3] = {};
  double width = 0.0;
  double to_world[3][4] = {}, to_object[3][4] = {};
};

const Ring &ring(const void *instance) { return *static_cast<const Ring *>(instance); }

void *create(const resolvent_create_args *args) {
  Ring *self = new (std::nothrow) Ring(*args);
  if (self && self->place()) return self;
  const resolvent_text why = RESOLVENT_TEXT("its transform leaves no volume");
  args->host->fail(args->host->ctx, why);
  delete self;
  return nullptr;
}

void destroy(void *instance) { delete static_cast<Ring *>(instance); }

resolvent_status info(const void *instance, resolvent_medium_info *out) {
  *out = ring(instance).info();
  return RESOLVENT_STATUS_OK;
}

resolvent_status sample(const void *instance, const resolvent_segment *s, const resolvent_flight_draws *u, resolvent_flight *out) {
  *out = ring(instance).sample(*s, *u);
  return RESOLVENT_STATUS_OK;
}

resolvent_status transmit(const void *instance, const resolvent_segment *s, const resolvent_flight_draws *u, resolvent_flight *out) {
  *out = ring(instance).transmit(*s, *u);
  return RESOLVENT_STATUS_OK;
}

resolvent_status depth(const void *instance, const resolvent_segment *s, resolvent_spectrum *out) {
  *out = grey(ring(instance).depth(*s));
  return RESOLVENT_STATUS_OK;
}

resolvent_status coefficients(const void *instance, const resolvent_float3 *p, resolvent_coefficients *out) {
  *out = ring(instance).coefficients(*p);
  return RESOLVENT_STATUS_OK;
}

const resolvent_medium_table table = {
    sizeof(resolvent_medium_table), 0, create, destroy, info, sample, transmit, depth, coefficients,
};

// Name, unit, help, default, choices; smallest, largest, kind, flags.
const resolvent_param_decl params[] = {
    {RESOLVENT_TEXT("sigma_t"), RESOLVENT_TEXT("1/length"), RESOLVENT_TEXT("extinction in the middle of the tube"),
     RESOLVENT_TEXT("10"), RESOLVENT_TEXT(""), 0.0, 0.0, RESOLVENT_PARAM_KIND_FLOAT, RESOLVENT_PARAM_FLAGS_MIN},
    {RESOLVENT_TEXT("albedo"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("scattering over extinction"), RESOLVENT_TEXT("0.95"),
     RESOLVENT_TEXT(""), 0.0, 1.0, RESOLVENT_PARAM_KIND_SPECTRUM, RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_MAX},
    {RESOLVENT_TEXT("width"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("radius of the tube, over that of the ring"), RESOLVENT_TEXT("0.3"),
     RESOLVENT_TEXT(""), 0.0, 1.0, RESOLVENT_PARAM_KIND_FLOAT,
     RESOLVENT_PARAM_FLAGS_MIN | RESOLVENT_PARAM_FLAGS_ABOVE_MIN | RESOLVENT_PARAM_FLAGS_MAX},
    {RESOLVENT_TEXT("phase"), RESOLVENT_TEXT(""), RESOLVENT_TEXT("phase function; isotropic unless given"), RESOLVENT_TEXT(""),
     RESOLVENT_TEXT("phase"), 0.0, 0.0, RESOLVENT_PARAM_KIND_PLUGIN, 0},
};

} // namespace

RESOLVENT_EXPORT resolvent_plugin = {
    RESOLVENT_MAGIC,
    RESOLVENT_ABI_MAJOR,
    RESOLVENT_ABI_MINOR,
    sizeof(resolvent_header),
    RESOLVENT_PLUGIN_KIND_MEDIUM,
    RESOLVENT_TEXT("smoke-ring"),
    RESOLVENT_TEXT("0.1.0"),
    RESOLVENT_TEXT("A torus of smoke."),
    params,
    sizeof params / sizeof *params,
    sizeof *params,
    &table,
};
