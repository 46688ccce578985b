/* Prints the estimates of one agent of a run as they are reported, with nothing of Consort but its IDL.
 *
 *   listener RUN DOMAIN AGENT
 *
 * RUN and DOMAIN are what `consort run` was given as --name and --domain; RUN is "" where it was given --open-domain. It ends when the
 * process of that agent has reported for the last time. The reader of reports is best effort, so that the run never waits for it. */

#include "consort.h"

#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>

static dds_entity_t must(dds_entity_t entity, const char *what) {
  if (entity >= 0) return entity;
  fprintf(stderr, "listener: %s: %s\n", what, dds_strretcode(-entity));
  exit(1);
}

static dds_entity_t join(const char *run, dds_domainid_t domain) {
  char configuration[1000];
  snprintf(configuration, sizeof configuration,
           "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces><AllowMulticast>spdp</AllowMulticast>"
           "</General><Discovery><Tag>%s</Tag></Discovery>",
           run);
  must(dds_create_domain(domain, configuration), "no domain");
  return must(dds_create_participant(domain, NULL, NULL), "no participant");
}

/* What an agent's estimate consists of is told once: whoever comes later gets it if it asks for it. */
static dds_entity_t read_layouts(dds_entity_t participant) {
  const dds_entity_t topic = must(dds_create_topic(participant, &consort_wire_Layout_desc, "consort_layout", NULL, NULL), "no topic");
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t reader = must(dds_create_reader(participant, topic, qos, NULL), "no reader");
  dds_delete_qos(qos);
  return reader;
}

static dds_entity_t read_reports(dds_entity_t participant) {
  const dds_entity_t topic = must(dds_create_topic(participant, &consort_wire_Telemetry_desc, "consort_telemetry", NULL, NULL), "no topic");
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t reader = must(dds_create_reader(participant, topic, qos, NULL), "no reader");
  dds_delete_qos(qos);
  return reader;
}

static void show_layout(const consort_wire_Layout *layout, unsigned agent) {
  if (layout->agent != agent) return;
  printf("agent %u estimates", agent);
  for (uint32_t f = 0; f < layout->estimate._length; ++f)
    printf(" %s (%u x %u)", layout->estimate._buffer[f].name, layout->estimate._buffer[f].rows, layout->estimate._buffer[f].columns);
  printf("\n");
}

/* True when the process that hosts the agent says that this was its last word. */
static bool show_reports(const consort_wire_Telemetry *telemetry, unsigned agent) {
  static bool met = false;
  static uint32_t process; /* that hosts the agent, once one has been met */
  for (uint32_t m = 0; m < telemetry->members._length; ++m) {
    const consort_wire_MemberReport *report = &telemetry->members._buffer[m];
    if (report->agent != agent) continue;
    const uint32_t rounds = report->rounds._length, size = rounds == 0 ? 0 : report->estimates._length / rounds;
    for (uint32_t r = 0; r < rounds; ++r) {
      printf("round %u:", report->rounds._buffer[r]);
      for (uint32_t i = 0; i < size; ++i) printf(" %.17g", report->estimates._buffer[r * size + i]);
      printf("\n");
    }
    process = telemetry->process;
    met = true;
  }
  fflush(stdout);
  return met && telemetry->process == process && telemetry->last;
}

int main(int argc, char **argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: listener RUN DOMAIN AGENT\n");
    return 2;
  }
  const unsigned agent = (unsigned)strtoul(argv[3], NULL, 10);
  const dds_entity_t participant = join(argv[1], (dds_domainid_t)strtoul(argv[2], NULL, 10));
  const dds_entity_t layouts = read_layouts(participant), reports = read_reports(participant);
  const dds_entity_t waiting = must(dds_create_waitset(participant), "no wait set");
  for (int i = 0; i < 2; ++i) {
    const dds_entity_t reader = i == 0 ? layouts : reports;
    dds_waitset_attach(waiting, must(dds_create_readcondition(reader, DDS_ANY_STATE), "no condition"), reader);
  }
  fprintf(stderr, "listener: waiting for agent %u of domain %s\n", agent, argv[2]);
  for (bool over = false; !over;) {
    dds_waitset_wait(waiting, NULL, 0, DDS_INFINITY);
    void *sample = NULL;
    dds_sample_info_t info;
    while (dds_take(layouts, &sample, &info, 1, 1) > 0) {
      if (info.valid_data) show_layout(sample, agent);
      dds_return_loan(layouts, &sample, 1);
    }
    while (!over && dds_take(reports, &sample, &info, 1, 1) > 0) {
      if (info.valid_data) over = show_reports(sample, agent);
      dds_return_loan(reports, &sample, 1);
    }
  }
  dds_delete(DDS_CYCLONEDDS_HANDLE);
  return 0;
}
