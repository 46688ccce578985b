#pragma once
/// Keyed randomness: a draw is a function of (seed, purpose, a, b, c, index) and of nothing else, so neither the order of
/// arrival nor the number of agents changes it. Counter-based generator Philox4x64-10 (Salmon et al. 2011).

#include <array>
#include <cstdint>
#include <string_view>

namespace consort {

/// A purpose hashed once; keep it `constexpr` where draws are hot.
struct Purpose {
  std::uint64_t hash;
  constexpr explicit Purpose(std::string_view name) : hash(1469598103934665603ULL) {
    for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;  // FNV-1a
  }
};

/// One keyed sequence of draws. Cheap to make, cheap to copy; equal keys give equal sequences.
class Stream {
 public:
  Stream(std::uint64_t seed, Purpose purpose, std::uint64_t a, std::uint64_t b, std::uint64_t c);

  std::uint64_t bits();                            ///< 64 uniform bits
  double uniform();                                ///< in [0, 1)
  double uniform(double low, double high);         ///< in [low, high)
  std::uint64_t below(std::uint64_t n);            ///< in 0..n-1 without bias; n >= 1
  double normal();                                 ///< N(0, 1) by Box-Muller (own transform: the library's differs between vendors)

 private:
  std::array<std::uint64_t, 2> key_;
  std::array<std::uint64_t, 4> counter_;
  std::array<std::uint64_t, 4> block_{};
  int used_ = 4;
  double spare_normal_ = 0.0;
  bool has_spare_ = false;
};

/// The seed of a run; every stream of the run is derived from it.
struct Seed {
  std::uint64_t value = 1;
  [[nodiscard]] Stream stream(Purpose purpose, std::uint64_t a = 0, std::uint64_t b = 0, std::uint64_t c = 0) const {
    return Stream(value, purpose, a, b, c);
  }
  auto operator<=>(const Seed&) const = default;
};

}  // namespace consort
