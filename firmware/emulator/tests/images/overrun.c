/* Does not read UART 0 for 2 ms after its first byte, then notes status and byte of all there is. */
#include <avr/io.h>
#include <util/delay.h>

#define LOG ((volatile uint8_t *)0x3F00)

int main(void) {
    uint8_t count = 0;
    UBRR0 = 1;
    UCSR0B = _BV(RXEN0);
    while (!(UCSR0A & _BV(RXC0))) {}
    _delay_ms(2);
    while (UCSR0A & _BV(RXC0)) {
        LOG[1 + 2 * count] = UCSR0A & (_BV(DOR0) | _BV(FE0));
        LOG[2 + 2 * count] = UDR0;
        LOG[0] = ++count;
    }
    for (;;) {}
}
