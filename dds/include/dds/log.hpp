#pragma once
/// dds::log: what Cyclone has to say of itself (ISO has no such thing). Of a domain that cannot be created its return code says nothing,
/// its log all.

#include <dds/dds.h>
#include <dds/ddsrt/log.h>

#include <functional>
#include <string_view>
#include <utility>

namespace dds::log {

/// Is told every warning and error, without time, process and line end, on whatever thread it arises; must not call DDS. Of `severe` ones
/// something could not be done.
using Sink = std::function<void(bool severe, std::string_view text)>;

namespace detail {

inline void write(void* sink, const dds_log_data_t* data) {
  std::string_view text(data->message, data->size);
  while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.remove_suffix(1);
  if (text.empty() || (data->priority & (DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING)) == 0) return;
  (*static_cast<const Sink*>(sink))((data->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0, text);
}

}  // namespace detail

/// From now on, for the whole process and its domains to come, instead of standard error. `sink` has to outlive DDS. Call it once, before
/// the first domain.
inline void set_sink(const Sink& sink) {
  auto* const argument = const_cast<Sink*>(&sink);
  dds_set_log_sink(&detail::write, argument);
  dds_set_trace_sink(&detail::write, argument);  // the same one: else what is configured to be traced is written beside it
}

}  // namespace dds::log
