/* Tries to erase a page from outside the boot section. */
#include <avr/boot.h>
#include <avr/io.h>

#define LOG ((volatile uint8_t *)0x3F00)

int main(void) {
    boot_page_erase(0x10000UL);
    LOG[0] = SPMCSR;
    LOG[1] = 1;
    for (;;) {}
}
