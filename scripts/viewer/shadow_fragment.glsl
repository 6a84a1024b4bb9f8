// The depth alone is kept.

void main()
{
}
