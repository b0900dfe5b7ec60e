/* A plugin of qemu's emulator of user programs (7.2, plugin interface 1): counts the instructions
 * that `lager-counted` carries out between its two marks, and prints their number.
 *
 *   cc -O2 -shared -fPIC -o libcount.so count.c; qemu-aarch64 -plugin ./libcount.so lager-counted STEP
 *
 * A mark is getpgid(MARK), which nothing else calls. Debian packs no header of the interface, so what
 * is used of it is declared here. */
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

/* getpgid's number on aarch64, and the process that it is asked for (benches/src/counted/main.rs). */
enum { GETPGID = 155, MARK = 0x6C616765 };

typedef uint64_t plugin;
struct qemu_plugin_tb;
typedef void block_translated(plugin, struct qemu_plugin_tb *);
typedef void call_begins(plugin, unsigned processor, int64_t number, uint64_t first, uint64_t,
                         uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t);
enum qemu_plugin_op { QEMU_PLUGIN_INLINE_ADD_U64 };

void qemu_plugin_register_vcpu_tb_trans_cb(plugin, block_translated *);
void qemu_plugin_register_vcpu_syscall_cb(plugin, call_begins *);
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb *, enum qemu_plugin_op,
                                              void *counter, uint64_t more);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);

int qemu_plugin_version = 1;

static uint64_t executed, at_first_mark;
static int marks;

/* A system call ends its block, so the count is exact at each mark. */
static void count_block(plugin self, struct qemu_plugin_tb *block) {
  (void)self;
  qemu_plugin_register_vcpu_tb_exec_inline(block, QEMU_PLUGIN_INLINE_ADD_U64, &executed,
                                           qemu_plugin_tb_n_insns(block));
}

static void look_at_call(plugin self, unsigned processor, int64_t number, uint64_t first, uint64_t b,
                         uint64_t c, uint64_t d, uint64_t e, uint64_t f, uint64_t g, uint64_t h) {
  (void)self, (void)processor, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h;
  if (number != GETPGID || first != MARK)
    return;
  if (marks++ == 0)
    at_first_mark = executed;
  else
    dprintf(STDOUT_FILENO, "%" PRIu64 "\n", executed - at_first_mark);
}

int qemu_plugin_install(plugin self, const void *machine, int count, char **values) {
  (void)machine, (void)count, (void)values;
  qemu_plugin_register_vcpu_tb_trans_cb(self, count_block);
  qemu_plugin_register_vcpu_syscall_cb(self, look_at_call);
  return 0;
}
