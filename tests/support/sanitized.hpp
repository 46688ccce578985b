#pragma once
/// CONSORT_SANITIZED: a sanitizer stands in front of malloc, so nobody else can.

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define CONSORT_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CONSORT_SANITIZED
#endif
#endif
