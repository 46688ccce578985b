#pragma once
/// A shelf in a file that has no name, so that it is gone with the process. It holds what the file system has room for.

#include "core/rows.hpp"

#include <filesystem>
#include <memory>

namespace consort {

/// On the file system of `folder`; nullptr without one.
std::shared_ptr<Shelf> spill_in(const std::filesystem::path& folder);

}  // namespace consort
