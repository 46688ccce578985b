#pragma once
/// Keyed randomness: a draw is a function of (seed, purpose, a, b, c, index) and of nothing else, so neither the order of
/// arrival nor the number of agents changes it. Counter-based generator Philox4x64-10 (Salmon et al. 2011).

#include <Random123/philox.h>

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

/// One block of Philox4x64-10: four uniform words, a bijection of the counter for each key.
inline std::array<std::uint64_t, 4> philox(const std::array<std::uint64_t, 2>& key, const std::array<std::uint64_t, 4>& counter) {
  const r123::Philox4x64::ctr_type in{{counter[0], counter[1], counter[2], counter[3]}};
  const r123::Philox4x64::key_type under{{key[0], key[1]}};
  const auto out = r123::Philox4x64{}(in, under);
  return {out[0], out[1], out[2], out[3]};
}

/// One keyed sequence of draws. Cheap to make, cheap to copy; equal keys give equal sequences.
/// Key {seed, purpose}, counter {a, b, c, block}; a block is computed when its first word is asked for.
class Stream {
 public:
  Stream(std::uint64_t seed, Purpose purpose, std::uint64_t a, std::uint64_t b, std::uint64_t c)
      : key_{seed, purpose.hash}, counter_{a, b, c, 0} {}

  /// 64 uniform bits.
  std::uint64_t bits() {
    if (used_ == 4) refill();
    return block_[static_cast<std::size_t>(used_++)];
  }
  /// In [0, 1), a multiple of 2^-53.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high);  ///< in [low, high); `low` if they are equal
  std::uint64_t below(std::uint64_t n);     ///< in 0..n-1 without bias; n >= 1
  double normal();                          ///< N(0, 1) by Box-Muller (own transform: the library's differs between vendors)

 private:
  void refill() {
    block_ = philox(key_, counter_);
    ++counter_[3];
    used_ = 0;
  }

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
