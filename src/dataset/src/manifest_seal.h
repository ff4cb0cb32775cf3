#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace terrane {

/// Where the 64 digits of "manifestSha256" stand in a manifest's text; nothing unless there is exactly one
/// such member, written as we write it.
std::optional<size_t> findSeal(std::string_view text);

/// The SHA-256 of a manifest's text with the 64 digits at `seal` taken as zeros.
std::string sealOf(std::string text, size_t seal);

/// The text with the right digits in its "manifestSha256"; unchanged where it has none.
std::string sealManifest(std::string text);

}  // namespace terrane
